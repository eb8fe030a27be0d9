//! The boxes that a large grid is cut into.

use glam::DVec3;
use s3d_fusion::Tile;

/// Voxels along the side of a block.
const SIDE: f64 = 8.0;

/// Blocks around what was measured that a surface may need.
const MARGIN: i32 = 2;

/// Returns the box of blocks around points, by their lowest and highest coordinates in metres.
pub(super) fn around([min, max]: [DVec3; 2], cell_m: f64) -> Tile {
    let block = |corner: DVec3| (corner / (cell_m * SIDE)).floor().as_ivec3();
    let [from, to] = [block(min) - MARGIN, block(max) + 1 + MARGIN];
    Tile { from: from.to_array(), to: to.to_array() }
}

/// Cuts a box across its longest side. Returns `None` for a single block.
pub(super) fn halves(tile: Tile) -> Option<[Tile; 2]> {
    let size = [0, 1, 2].map(|k| tile.to[k] - tile.from[k]);
    // The first of several that are as long.
    let longest = (0..3).rev().max_by_key(|k| size[*k]).filter(|k| size[*k] > 1)?;
    let middle = tile.from[longest] + size[longest] / 2;
    let (mut low, mut high) = (tile, tile);
    (low.to[longest], high.from[longest]) = (middle, middle);
    Some([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_what_was_measured_and_halves_are_the_whole() {
        let tile = around([DVec3::new(-0.01, 0.0, 0.0), DVec3::new(4.0, 0.5, 0.07)], 0.01);
        assert_eq!((tile.from, tile.to), ([-3, -2, -2], [53, 9, 3]));
        let [low, high] = halves(tile).unwrap();
        assert_eq!((low.from, high.to, low.to[0], high.from[0]), (tile.from, tile.to, 25, 25));
        assert_eq!(halves(Tile { from: [1; 3], to: [2; 3] }), None);
    }
}
