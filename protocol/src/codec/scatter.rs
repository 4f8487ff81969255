//! How depth lies over the pixels of some samples: counts, means and products about the means, which of two sets give those of
//! both (Chan, Golub, LeVeque 1979, §2) without the cancellation of sums of squares.

/// Sums over a few samples near a corner, which are exact in whole numbers: as quick as can be.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    count: u64,
    /// Of x, y and depth.
    sum: [u64; 3],
    xx: u64,
    xy: u64,
    yy: u64,
    xz: u64,
    yz: u64,
    zz: u64,
}

impl Sums {
    /// Adds samples side by side in a row, from a pixel on.
    #[inline(always)]
    pub fn add(&mut self, [x, y]: [usize; 2], depth: &[u16]) {
        let [mut z, mut xz, mut zz] = [0_u64; 3];
        for (x, &depth) in (x as u64..).zip(depth) {
            let depth = u64::from(depth);
            z += depth;
            xz += x * depth;
            zz += depth * depth;
        }
        let (count, first, y) = (depth.len() as u64, x as u64, y as u64);
        let last = first + count - 1;
        let x = (first + last) * count / 2;
        // Sums of squares up to a number.
        let squares = |to: u64| to * (to + 1) * (2 * to + 1) / 6;
        self.count += count;
        self.sum = [self.sum[0] + x, self.sum[1] + y * count, self.sum[2] + z];
        self.xx += squares(last) - first.checked_sub(1).map_or(0, squares);
        self.xy += x * y;
        self.yy += y * y * count;
        self.xz += xz;
        self.yz += y * z;
        self.zz += zz;
    }

    pub fn count(&self) -> u64 {
        self.count
    }

    /// What they say of samples, with the corner at a pixel.
    pub fn scatter(&self, corner: [f64; 2]) -> Scatter {
        let count = self.count as f64;
        let [x, y, z] = self.sum.map(|sum| sum as f64);
        let about_mean = |sum: u64, a: f64, b: f64| sum as f64 - a * b / count;
        let products = Products {
            xx: about_mean(self.xx, x, x),
            xy: about_mean(self.xy, x, y),
            yy: about_mean(self.yy, y, y),
            xz: about_mean(self.xz, x, z),
            yz: about_mean(self.yz, y, z),
            zz: about_mean(self.zz, z, z),
        };
        Scatter { count, mean: [corner[0] + x / count, corner[1] + y / count, z / count], products }
    }
}

/// Of a set of samples; depth in steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scatter {
    pub count: f64,
    /// Of x, y and depth.
    pub mean: [f64; 3],
    /// Sums of products about the means.
    products: Products,
}

#[derive(Debug, Clone, Copy)]
struct Products {
    xx: f64,
    xy: f64,
    yy: f64,
    xz: f64,
    yz: f64,
    zz: f64,
}

impl Scatter {
    /// Of both sets.
    pub fn with(&self, other: &Scatter) -> Scatter {
        let count = self.count + other.count;
        let share = other.count / count;
        let weight = self.count * share;
        let apart: [f64; 3] = std::array::from_fn(|axis| other.mean[axis] - self.mean[axis]);
        let [x, y, z] = apart;
        let (a, b) = (&self.products, &other.products);
        let products = Products {
            xx: a.xx + b.xx + weight * x * x,
            xy: a.xy + b.xy + weight * x * y,
            yy: a.yy + b.yy + weight * y * y,
            xz: a.xz + b.xz + weight * x * z,
            yz: a.yz + b.yz + weight * y * z,
            zz: a.zz + b.zz + weight * z * z,
        };
        Scatter { count, mean: std::array::from_fn(|axis| self.mean[axis] + share * apart[axis]), products }
    }

    /// The slopes along x and y of the plane through the middle with the least squares of differences. None where the samples lie
    /// along a line to within a pixel, so that rounding alone would decide about a slope.
    pub fn slopes(&self) -> Option<[f64; 2]> {
        let Products { xx, xy, yy, xz, yz, .. } = self.products;
        let determinant = xx * yy - xy * xy;
        let is_spread = determinant >= self.count * self.count;
        is_spread.then(|| [(xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant])
    }

    /// Whether the squares of differences of `samples` from a plane through the middle of `self` are at most this in the mean.
    pub fn fits(&self, samples: &Scatter, [a, b]: [f64; 2], most_variance: f64) -> bool {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| samples.mean[axis] - self.mean[axis]);
        let Products { xx, xy, yy, xz, yz, zz } = samples.products;
        let about_mean = zz + a * a * xx + b * b * yy + 2.0 * (a * b * xy - a * xz - b * yz);
        let off = z - a * x - b * y;
        about_mean <= samples.count * (most_variance - off * off)
    }
}
