//! A palette: a few colours, their shares in a box and around it, and how well the two differ.
//!
//! It stands for the colour features of the paper, whose form is not public. A colour is spread over the
//! entries next to it: these are the histograms of Swain and Ballard (1991) with soft borders. Lightness is
//! relative to the mean of the space, so that the light of a room counts little. Each surfel has a number for
//! how much more of its colour the box has than its surroundings: this is the back-projection of Swain and
//! Ballard, with the surroundings in the place of the image.

use glam::Vec3;
use s3d_geom::Aabb;

/// The hues of the palette, in sixths of the circle: from red over yellow, green, cyan and blue.
const HUES: [f32; 9] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0];
/// The lightness of the coloured entries, as shares of the mean of the space.
const LIGHTNESS: [f32; 2] = [0.35, 0.9];
/// The lightness of the greys, likewise.
const GREYS: [f32; 4] = [0.25, 0.55, 0.85, 1.15];
/// A colour below the first saturation is grey, above the second it is coloured, in between it is both.
const SATURATED: [f32; 2] = [0.06, 0.22];

/// The number of colours of a palette.
pub const ENTRIES: usize = HUES.len() * LIGHTNESS.len() + GREYS.len();

/// The amount of each colour.
pub type Shares = [f32; ENTRIES];

/// The entries that a colour is spread over, and their shares in 255ths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shade([(u8, u8); 6]);

impl Shade {
    /// Spreads a colour (R G B, 0 to 1) in a space of this mean colour.
    pub fn new(color: Vec3, mean: Vec3) -> Self {
        let lightness = color.element_sum() / mean.element_sum().max(0.05);
        let most = color.max_element();
        let chroma = most - color.min_element();
        let saturation = if most > 0.0 { chroma / most } else { 0.0 };
        let [low, high] = SATURATED;
        let colored = ((saturation - low) / (high - low)).clamp(0.0, 1.0);

        let mut shares = [(0, 0.0); 6];
        if colored > 0.0 {
            let light = between(&LIGHTNESS, lightness);
            let hue = between_hues(hue(color, most, chroma));
            for (i, (h, l)) in [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().enumerate() {
                let (entry, of_hue) = hue[h];
                shares[i] = (entry * LIGHTNESS.len() + light[l].0, colored * of_hue * light[l].1);
            }
        }
        for (k, (grey, share)) in between(&GREYS, lightness).into_iter().enumerate() {
            shares[4 + k] = (HUES.len() * LIGHTNESS.len() + grey, (1.0 - colored) * share);
        }

        Self(shares.map(|(entry, share)| (entry as u8, (255.0 * share).round() as u8)))
    }

    fn add_to(self, shares: &mut Shares) {
        for (entry, share) in self.0 {
            shares[usize::from(entry)] += f32::from(share);
        }
    }

    fn weighed(self, weights: &Shares) -> f32 {
        self.0
            .iter()
            .map(|&(entry, share)| weights[usize::from(entry)] * f32::from(share))
            .sum::<f32>()
            / 255.0
    }
}

/// Returns the place of a colour on the circle of hues, in sixths.
fn hue(color: Vec3, most: f32, chroma: f32) -> f32 {
    let [r, g, b] = color.to_array();
    if chroma <= 0.0 {
        0.0
    } else if most == r {
        ((g - b) / chroma).rem_euclid(6.0)
    } else if most == g {
        (b - r) / chroma + 2.0
    } else {
        (r - g) / chroma + 4.0
    }
}

/// Returns the two places next to a value, and the share of each.
fn between(places: &[f32], value: f32) -> [(usize, f32); 2] {
    let value = value.clamp(places[0], places[places.len() - 1]);
    let high = places.iter().position(|p| *p >= value).unwrap_or(0).max(1);
    let share = (value - places[high - 1]) / (places[high] - places[high - 1]);
    [(high - 1, 1.0 - share), (high, share)]
}

fn between_hues(hue: f32) -> [(usize, f32); 2] {
    let last = HUES.len() - 1;
    if hue <= HUES[last] {
        return between(&HUES, hue);
    }
    let share = ((hue - HUES[last]) / (6.0 - HUES[last])).clamp(0.0, 1.0);
    [(last, 1.0 - share), (0, share)]
}

/// The number of layers of a box, each with shares of its own: thirds, from below.
pub const LAYERS: usize = 3;
/// A surfel this near to a box counts as inside, in metres, since thin boxes are as thin as noise.
const NEAR_M: f32 = 0.005;
/// Added to the shares that [`Palette::own`] divides by: a difference of small shares counts little.
const LITTLE: f32 = 0.02;

/// The colours of a box and of its surroundings.
#[derive(Clone, Debug, PartialEq)]
pub struct Palette {
    /// The colours in each third of the box, from below.
    pub layers: [Shares; LAYERS],
    /// The colours at each side of the box: the low ends of x, y and z, then the high ends.
    pub sides: [Shares; 6],
}

impl Palette {
    /// Counts the surfels in a box and around it.
    pub fn new<'a>(b: &Aabb, surfels: impl Iterator<Item = (Vec3, &'a Shade)>) -> Self {
        let mut palette = Self { layers: [[0.0; ENTRIES]; LAYERS], sides: [[0.0; ENTRIES]; 6] };
        let size = b.size().max(Vec3::splat(NEAR_M));
        for (position, shade) in surfels {
            let out = (b.min - position).max(position - b.max);
            let shares = if out.max_element() <= NEAR_M {
                let layer = LAYERS as f32 * (position.z - b.min.z) / size.z;
                &mut palette.layers[(layer.max(0.0) as usize).min(LAYERS - 1)]
            } else {
                // Outside of two sides: the farther one counts, as a share of the size.
                let away = (out / size).to_array();
                let axis = (1..3).fold(0, |far, k| if away[k] > away[far] { k } else { far });
                &mut palette.sides[if position[axis] < b.min[axis] { axis } else { 3 + axis }]
            };
            shade.add_to(shares);
        }
        palette
    }

    /// Returns the shares in the box, then around it.
    pub fn inside_and_around(&self) -> [Shares; 2] {
        [share(&sum(&self.layers)), share(&sum(&self.sides))]
    }

    /// Returns how much the colours of each side differ from the colours of the box, then the colours of all
    /// sides together: 0 to 1. `None` where there are no surfels.
    pub fn contrasts(&self) -> [Option<f32>; 7] {
        let inside = sum(&self.layers);
        let mut out = [None; 7];
        let all = [sum(&self.sides)];
        for (contrast, around) in out.iter_mut().zip(self.sides.iter().chain(&all)) {
            if total(&inside) > 0.0 && total(around) > 0.0 {
                let p = share(&inside);
                let q = share(around);
                *contrast = Some(0.5 * p.iter().zip(q).map(|(p, q)| (p - q).abs()).sum::<f32>());
            }
        }
        out
    }

    /// Returns for each colour how much more of it is in the box than around it: −1 to 1.
    pub fn own(&self) -> Shares {
        let [inside, around] = self.inside_and_around();
        std::array::from_fn(|i| (inside[i] - around[i]) / (inside[i] + around[i] + LITTLE))
    }
}

/// Returns how much of a shade is the box's own, −1 to 1; `own` is [`Palette::own`] of the box.
pub fn own_of(shade: &Shade, own: &Shares) -> f32 {
    shade.weighed(own)
}

fn sum(of: &[Shares]) -> Shares {
    std::array::from_fn(|i| of.iter().map(|shares| shares[i]).sum())
}

fn total(shares: &Shares) -> f32 {
    shares.iter().sum()
}

/// Scales amounts to a sum of 1; they stay 0 if there is nothing.
pub fn share(shares: &Shares) -> Shares {
    let total = total(shares);
    if total > 0.0 {
        shares.map(|s| s / total)
    } else {
        *shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    const MEAN: Vec3 = Vec3::splat(0.7);

    fn strongest_entry(color: Vec3) -> usize {
        let mut shares = [0.0; ENTRIES];
        Shade::new(color, MEAN).add_to(&mut shares);
        (0..ENTRIES).fold(0, |best, i| if shares[i] > shares[best] { i } else { best })
    }

    #[test]
    fn shares_of_a_colour_sum_to_one_and_move_with_it() {
        for i in 0..2000u32 {
            let r = |k: u32| (i.wrapping_mul(k) % 997) as f32 / 996.0;
            let shade = Shade::new(vec3(r(7919), r(104_729), r(1_299_709)), MEAN);
            let mut shares = [0.0; ENTRIES];
            shade.add_to(&mut shares);
            assert!((total(&shares) - 255.0).abs() <= 3.0, "{shares:?}");
        }
        // Dark red, dark green and light blue; black to white.
        assert_eq!(strongest_entry(vec3(0.9, 0.1, 0.1)), 0);
        assert_eq!([strongest_entry(vec3(0.1, 0.8, 0.1)), strongest_entry(vec3(0.3, 0.3, 1.0))], [8, 15]);
        assert_eq!([0.1, 0.4, 0.6, 0.9].map(|l| strongest_entry(Vec3::splat(l))), [18, 19, 20, 21]);
        assert_eq!(strongest_entry(vec3(0.9, 0.1, 0.2)), strongest_entry(vec3(0.9, 0.2, 0.1)));
        let _ = (Shade::new(Vec3::ZERO, Vec3::ZERO), Shade::new(Vec3::ONE, Vec3::ZERO));
    }

    #[test]
    fn contrasts_are_high_where_a_box_differs_from_its_surroundings() {
        let b = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let red = Shade::new(vec3(0.8, 0.1, 0.1), MEAN);
        let white = Shade::new(Vec3::splat(0.9), MEAN);
        let places = [vec3(0.5, 0.5, 0.1), vec3(0.5, 0.5, 0.9), vec3(-0.2, 0.5, 1.1), vec3(0.5, 0.5, 1.2)];
        let palette = Palette::new(&b, places.into_iter().zip([&red, &red, &white, &red]));
        assert_eq!([0, 1, 2].map(|k| total(&palette.layers[k]) > 0.0), [true, false, true]);
        let contrasts = palette.contrasts();
        let at = |k: usize| contrasts[k].map(|c| (100.0 * c).round());
        assert_eq!([at(0), at(1), at(5), at(6)], [Some(100.0), None, Some(0.0), Some(50.0)]);
        let own = palette.own();
        assert!(own_of(&red, &own) > 0.2 && own_of(&white, &own) < -0.9, "{own:?}");
    }
}
