//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004), with the window and constants that scikit-image uses by
//! default: 7x7 uniform window, sample covariance, `K1 = 0.01`, `K2 = 0.03`, the mean over windows that lie inside, and the
//! mean over the three colours of values 0 to 1.

use super::{Picture, PictureError};

/// Edge of the window.
const WINDOW_PX: usize = 7;
const K1: f64 = 0.01;
const K2: f64 = 0.03;

/// Mean structural similarity, 1 for equal pictures. Pictures must be at least 7x7 pixels.
pub fn ssim(frame: &Picture, truth: &Picture) -> Result<f64, PictureError> {
    frame.same_size_as(truth)?;
    let (width, height) = (truth.width_px as usize, truth.height_px as usize);
    if width < WINDOW_PX || height < WINDOW_PX {
        return Err(PictureError::Small { width_px: truth.width_px, height_px: truth.height_px });
    }
    let channels = (0..3).map(|channel| {
        let plane = |picture: &Picture| picture.rgb.iter().skip(channel).step_by(3).map(|&v| u64::from(v)).collect();
        let (x, y): (Vec<u64>, Vec<u64>) = (plane(frame), plane(truth));
        mean_over_windows(&x, &y, width, height)
    });
    Ok(channels.sum::<f64>() / 3.0)
}

/// Sums of `f(i)` over each window inside of the image: exact, in integers, from one running table.
fn window_sums(width: usize, height: usize, f: impl Fn(usize) -> u64) -> Vec<u64> {
    let stride = width + 1;
    let mut table = vec![0_u64; stride * (height + 1)];
    for y in 0..height {
        let mut row_sum = 0;
        for x in 0..width {
            row_sum += f(y * width + x);
            table[(y + 1) * stride + x + 1] = table[y * stride + x + 1] + row_sum;
        }
    }
    let corner = |x: usize, y: usize| table[y * stride + x];
    let (columns, rows) = (width - WINDOW_PX + 1, height - WINDOW_PX + 1);
    let mut sums = Vec::with_capacity(columns * rows);
    for y in 0..rows {
        for x in 0..columns {
            let (right, bottom) = (x + WINDOW_PX, y + WINDOW_PX);
            sums.push(corner(right, bottom) + corner(x, y) - corner(right, y) - corner(x, bottom));
        }
    }
    sums
}

fn mean_over_windows(x: &[u64], y: &[u64], width: usize, height: usize) -> f64 {
    let sums = |f: &dyn Fn(usize) -> u64| window_sums(width, height, f);
    let (sum_x, sum_y) = (sums(&|i| x[i]), sums(&|i| y[i]));
    let (sum_xx, sum_yy, sum_xy) = (sums(&|i| x[i] * x[i]), sums(&|i| y[i] * y[i]), sums(&|i| x[i] * y[i]));
    let count = (WINDOW_PX * WINDOW_PX) as f64;
    let (c1, c2) = ((K1 * 255.0).powi(2), (K2 * 255.0).powi(2));
    let total: f64 = (0..sum_x.len())
        .map(|i| {
            let (mean_x, mean_y) = (sum_x[i] as f64 / count, sum_y[i] as f64 / count);
            let covariance = |product: u64, a: f64, b: f64| (product as f64 - count * a * b) / (count - 1.0);
            let variance_x = covariance(sum_xx[i], mean_x, mean_x);
            let variance_y = covariance(sum_yy[i], mean_y, mean_y);
            let covariance_xy = covariance(sum_xy[i], mean_x, mean_y);
            ((2.0 * mean_x * mean_y + c1) * (2.0 * covariance_xy + c2))
                / ((mean_x * mean_x + mean_y * mean_y + c1) * (variance_x + variance_y + c2))
        })
        .sum();
    total / sum_x.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The formula as it is written, one window at a time, in another arithmetic.
    fn by_hand(x: &Picture, y: &Picture) -> f64 {
        let value =
            |p: &Picture, u: u32, v: u32, c: u32| f64::from(p.rgb[((v * p.width_px + u) * 3 + c) as usize]) / 255.0;
        let (mut total, mut windows) = (0.0, 0.0);
        for c in 0..3 {
            for v in 0..=x.height_px - 7 {
                for u in 0..=x.width_px - 7 {
                    let pairs: Vec<(f64, f64)> = (0..49)
                        .map(|i| (value(x, u + i % 7, v + i / 7, c), value(y, u + i % 7, v + i / 7, c)))
                        .collect();
                    let (mx, my) = pairs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / 49.0, s.1 + p.1 / 49.0));
                    let vx: f64 = pairs.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>() / 48.0;
                    let vy: f64 = pairs.iter().map(|p| (p.1 - my).powi(2)).sum::<f64>() / 48.0;
                    let vxy: f64 = pairs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / 48.0;
                    total +=
                        ((2.0 * mx * my + 1e-4) * (2.0 * vxy + 9e-4)) / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4));
                    windows += 1.0;
                }
            }
        }
        total / windows
    }

    #[test]
    fn equals_the_formula_window_by_window() {
        let noise = |seed: u32| {
            let mut state = seed;
            let mut picture = Picture::filled(19, 11, [0; 3]);
            for value in &mut picture.rgb {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *value = (state >> 24) as u8;
            }
            picture
        };
        let x = noise(1);
        let mut y = x.clone();
        y.rgb.iter_mut().zip(noise(2).rgb).for_each(|(value, other)| *value = value.saturating_add(other / 8));
        let (found, expected) = (ssim(&x, &y).unwrap(), by_hand(&x, &y));
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        assert!(found > 0.5 && found < 0.99);
    }

    #[test]
    fn constant_pictures_leave_the_luminance_term() {
        let (x, y) = (Picture::filled(7, 7, [51; 3]), Picture::filled(7, 7, [102; 3]));
        let expected = (2.0 * 0.2 * 0.4 + 1e-4) / (0.04 + 0.16 + 1e-4);
        assert!((ssim(&x, &y).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_picture_smaller_than_the_window_is_refused() {
        let small = Picture::filled(6, 20, [0; 3]);
        assert!(matches!(ssim(&small, &small), Err(PictureError::Small { .. })));
    }
}
