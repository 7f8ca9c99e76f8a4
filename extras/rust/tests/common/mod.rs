// SPDX-License-Identifier: MIT
//! Random and hostile boxes: the same in every run.
#![allow(dead_code)]

/// Splitmix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }
    /// Between 0 and 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Numbers that make trouble: equal ones, zeros of both signs, tiny, huge and infinite ones.
const ODD: [f64; 10] = [0.0, -0.0, 1.0, 2.0, -1.0, 1e-38, -1e-38, 3e38, f64::INFINITY, f64::NEG_INFINITY];

pub fn box_of<const D: usize>(random: &mut Random, hostile: bool, space: f64) -> [[f32; D]; 2] {
    let mut made = [[0.0; D]; 2];
    for axis in 0..D {
        let mut ends = if hostile {
            [ODD[random.below(ODD.len())], ODD[random.below(ODD.len())]]
        } else {
            let lo = random.unit() * space;
            [lo, lo + random.unit()]
        };
        if ends[0] > ends[1] {
            ends.swap(0, 1);
        }
        made[0][axis] = ends[0] as f32;
        made[1][axis] = ends[1] as f32;
    }
    made
}
pub fn boxes<const D: usize>(random: &mut Random, count: usize, hostile: bool) -> Vec<[[f32; D]; 2]> {
    let space = (count as f64).powf(1.0 / D as f64) + 0.1;
    (0..count).map(|_| box_of(random, hostile, space)).collect()
}
/// The definition.
pub fn touch<T: PartialOrd, const D: usize>(a: &[[T; D]; 2], b: &[[T; D]; 2]) -> bool {
    (0..D).all(|axis| a[0][axis] <= b[1][axis] && b[0][axis] <= a[1][axis])
}
pub fn touching<T: PartialOrd, const D: usize>(boxes: &[[[T; D]; 2]]) -> Vec<(u32, u32)> {
    let mut all = Vec::new();
    for b in 0..boxes.len() {
        all.extend((0..b).filter(|a| touch(&boxes[*a], &boxes[b])).map(|a| (a as u32, b as u32)));
    }
    all.sort_unstable();
    all
}
