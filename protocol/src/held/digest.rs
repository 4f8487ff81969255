//! The running digest of what is held.
//!
//! Both ends fold every edit into 64 bits and compare the result, so a client whose copy went wrong is found at its next
//! ack. It guards against faults, not against forgery. Only integers enter - numbers, ids, addresses, sizes, codes - never
//! floats, which two machines may print, parse or round differently; but for poses that objects go on from, of which each bit is told.
//!
//! Mixing: `state = (state ^ value) * K`, then the high half is folded onto the low one; `K` is odd (the golden ratio in 64
//! bits, Knuth, TAOCP 3, 6.4), so every step is a bijection of the state and a single different value can never cancel out.

use super::{Edit, Instance, ObjectPose, ObjectShift, Patch, Purpose};
use crate::body::Body;

/// The digest of an empty copy.
pub(super) const EMPTY: u64 = 0x5641_4e54_4147_4501;
const GOLDEN_RATIO: u64 = 0x9e37_79b9_7f4a_7c15;

#[derive(Debug, Clone, Copy)]
pub(super) struct Digest(pub u64);

impl Digest {
    pub fn number(&mut self, value: u64) {
        let product = (self.0 ^ value).wrapping_mul(GOLDEN_RATIO);
        self.0 = product ^ product >> 32;
    }

    /// Undoes [`Digest::number`] of a value.
    pub fn take_back(&mut self, value: u64) {
        let product = self.0 ^ self.0 >> 32;
        self.0 = product.wrapping_mul(inverse(GOLDEN_RATIO)) ^ value;
    }

    /// Bytes in eights, the last group filled up with zeros; the length goes in first.
    fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        let (eights, rest) = bytes.as_chunks::<8>();
        for eight in eights {
            self.number(u64::from_le_bytes(*eight));
        }
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.number(u64::from_le_bytes(last));
    }

    /// Numbers in fours, as [`Digest::bytes`] of their little-endian bytes.
    fn shorts(&mut self, shorts: &[u16]) {
        self.number(shorts.len() as u64);
        let pack = |four: &[u16]| four.iter().rev().fold(0, |packed, &short| packed << 16 | u64::from(short));
        let (fours, rest) = shorts.as_chunks::<4>();
        for four in fours {
            self.number(pack(four));
        }
        self.number(pack(rest));
    }

    pub fn edit(&mut self, edit: &Edit) {
        match edit {
            Edit::Clear => self.0 = EMPTY,
            Edit::Add(patch) => {
                self.number(1);
                self.patch(patch);
            }
            Edit::Remove(id) => {
                self.number(2);
                self.number(u64::from(id.0));
            }
            Edit::Delete(id, addresses) => {
                self.number(3 | u64::from(id.0) << 8);
                self.number(addresses.len() as u64);
                for &(x, y) in addresses {
                    self.number(u64::from(x) | u64::from(y) << 16);
                }
            }
            Edit::Trim(id, trims) => {
                self.number(4 | u64::from(id.0) << 8);
                self.number(trims.len() as u64);
                for &(x, y, extent) in trims {
                    self.number(u64::from(x) | u64::from(y) << 16 | u64::from(extent) << 32);
                }
            }
            // An object goes on from there for as long as it is held: each bit counts.
            Edit::Move(poses) => {
                self.number(5);
                self.objects(poses);
                let numbers = poses.iter().flat_map(|pose| pose.world_from_object.to_cols_array());
                numbers.for_each(|number| self.number(number.to_bits()));
            }
            Edit::Shift(shifts) => {
                self.number(12);
                self.number(shifts.len() as u64);
                for ObjectShift { object, matrix, translation } in shifts {
                    let exponents = [matrix.exponent, translation.exponent].map(|exponent| u64::from(exponent as u16));
                    self.number(u64::from(*object) | exponents[0] << 16 | exponents[1] << 32);
                    let counts = matrix.counts.iter().chain(&translation.counts);
                    counts.for_each(|&count| self.number(u64::from(count as u32)));
                }
            }
            Edit::Place(relief, instances) => {
                self.number(8 | u64::from(relief.0) << 8);
                self.number(instances.len() as u64);
                for Instance { pose, tint: [red, green, blue] } in instances {
                    let tint = u32::from_le_bytes([*red, *green, *blue, 0]);
                    self.number(u64::from(pose.object) | u64::from(tint) << 16);
                }
            }
            Edit::Body(id, body) => {
                self.number(11 | u64::from(id.0) << 8);
                self.body(body);
            }
            Edit::Withdraw(objects) => {
                self.number(9);
                self.shorts(objects);
            }
            Edit::Materials(materials) => self.number(6 | (materials.len() as u64) << 8),
            Edit::Light(lighting) => self.number(7 | (lighting.lights.len() as u64) << 8),
            Edit::Sky(sky) => {
                self.number(10 | u64::from(sky.first_level) << 8);
                for level in &sky.levels {
                    self.shorts(level.texels.as_flattened());
                }
            }
            Edit::Join(bits) => self.0 ^= bits,
        }
    }

    fn patch(&mut self, patch: &Patch) {
        self.number(u64::from(patch.id.0));
        self.number(match patch.purpose {
            Purpose::Eye => 0,
            Purpose::Light(light) => 1 | u64::from(light) << 8,
            Purpose::Impostor(object) => 2 | u64::from(object) << 8,
            Purpose::Environment => 3,
            Purpose::Relief(object) => 4 | u64::from(object) << 8,
            Purpose::Inside(object) => 5 | u64::from(object) << 8,
            Purpose::Rest => 6,
            Purpose::Camera => 7,
            Purpose::Occluders => 8,
            Purpose::Layer(layer) => 9 | u64::from(layer) << 8,
            Purpose::Body => 10,
        });
        self.objects(&patch.objects);
        let image = &patch.image;
        let (width_px, height_px) = image.mask.size_px();
        self.number(u64::from(width_px) | u64::from(height_px) << 32);
        for &word in image.mask.words() {
            self.number(word);
        }
        self.shorts(&image.depth);
        self.bytes(image.normal.as_flattened());
        self.bytes(&image.normal_rest);
        self.bytes(&image.share);
        self.bytes(&image.colour_rest);
        self.shorts(&image.ends);
        self.bytes(image.colour.as_flattened());
        self.shorts(&image.object);
        self.bytes(&image.material);
    }

    fn body(&mut self, body: &Body) {
        self.shorts(body.positions.as_flattened());
        self.shorts(body.normals.as_flattened());
        self.shorts(body.uvs.as_flattened());
        self.bytes(body.colours.as_flattened());
        self.number(body.indices.len() as u64);
        body.indices.iter().for_each(|&index| self.number(index.into()));
        let Some(skin) = &body.skin else { return };
        self.bytes(skin.bones.as_flattened());
        self.shorts(skin.shares.as_flattened());
        self.number(skin.clip.codes.len() as u64 | u64::from(skin.clip.bones) << 32);
        skin.clip.codes.iter().for_each(|&code| self.number(code as u32 as u64));
    }

    fn objects(&mut self, poses: &[ObjectPose]) {
        self.number(poses.len() as u64);
        for pose in poses {
            self.number(u64::from(pose.object));
        }
    }
}

/// The number by which an odd one gives 1 modulo `2^64`: Newton's steps double the right bits, of which an odd number itself has three.
const fn inverse(odd: u64) -> u64 {
    let mut inverse = odd;
    let mut right_bits = 3;
    while right_bits < 64 {
        inverse = inverse.wrapping_mul(2_u64.wrapping_sub(odd.wrapping_mul(inverse)));
        right_bits *= 2;
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_taken_back() {
        for (state, value) in [(EMPTY, 0), (1, u64::MAX), (0xdead_beef_0123_4567, 42)] {
            let mut digest = Digest(state);
            digest.number(value);
            assert_ne!(digest.0, state);
            digest.take_back(value);
            assert_eq!(digest.0, state);
        }
    }
}
