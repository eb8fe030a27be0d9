//! A small room with furniture in its corners.

use super::checked;
use super::shell::{shell, speckled};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::Vec3;
use s3d_geom::glam::{vec2, vec3};
use s3d_geom::primitives::{cuboid, cylinder};
use s3d_geom::{Material, MeshParts, TriMesh};

/// A closed, textured room with furniture in its corners, from the origin to between (4.5, 4, 2.6) and (6,
/// 5.5, 3) metres; its middle is free from floor to ceiling. The same `seed` gives the same room.
pub fn furnished_room(seed: u64) -> TriMesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let size = vec3(rng.random_range(4.5..6.0), rng.random_range(4.0..5.5), rng.random_range(2.6..3.0));
    let mut parts = shell(Vec3::ZERO, size, (size / 0.25).as_uvec3().to_array(), |_, _| true);

    for (material, name) in ["floor", "wall", "ceiling"].into_iter().enumerate() {
        parts.materials[material].texture = Some(parts.textures.len() as u32);
        parts.textures.push(speckled(&mut rng, name));
    }

    for corner in [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(1.0, 1.0)] {
        // The item's box, 5 to 20 cm off the walls.
        let extent = vec2(rng.random_range(0.8..1.3), rng.random_range(0.5..0.9));
        let gap = vec2(rng.random_range(0.05..0.2), rng.random_range(0.05..0.2));
        let low = gap + corner * (size.truncate() - extent - 2.0 * gap);
        let high = low + extent;

        let kind = rng.random_range(0..3);
        let mut item = match kind {
            0 => {
                let top = rng.random_range(0.68..0.76);
                let legs = [low, vec2(high.x - 0.05, low.y), high - 0.05, vec2(low.x, high.y - 0.05)];
                let legs = legs.map(|p| cuboid(p.extend(0.005), (p + 0.05).extend(top)));
                MeshParts::merge(
                    [cuboid(low.extend(top), high.extend(top + 0.03))]
                        .into_iter()
                        .chain(legs),
                )
            }
            1 => cuboid(low.extend(0.005), high.extend(rng.random_range(0.8..1.9))),
            _ => cylinder(((low + high) * 0.5).extend(0.005), 0.5 * extent.y, rng.random_range(0.4..1.0), 24),
        };

        let name = ["table", "bookcase", "clutter"][kind];
        let color = std::array::from_fn(|_| rng.random_range(40..220));
        item.materials = vec![Material { name: name.into(), color, texture: (kind == 1).then_some(0) }];
        item.textures.extend((kind == 1).then(|| speckled(&mut rng, name)));
        item.face_materials = vec![0; item.faces.len()];
        parts.append(item);
    }

    checked(parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::shell::tests::{digest, open_edges};
    use proptest::prelude::*;
    use s3d_geom::FaceColor;

    proptest! {
        #[test]
        fn furnished_rooms_are_closed_textured_and_free_in_the_middle(seed in any::<u64>()) {
            let m = furnished_room(seed);
            prop_assert_eq!(open_edges(m.parts()), 0);
            prop_assert_eq!(digest(&m), digest(&furnished_room(seed)));
            let faces = 0..m.faces().len() as u32;
            let textured = faces.filter(|f| matches!(m.color_of(*f), FaceColor::Texture(..))).count();
            prop_assert!(textured * 2 > m.faces().len());
            let middle = m.aabb().center();
            let height = m.aabb().max.z;
            for p in m.positions() {
                // Whatever is near the middle's vertical belongs to floor or ceiling.
                let near = p.truncate().distance(middle.truncate()) < 0.4;
                prop_assert!(!near || p.z == 0.0 || p.z == height, "{}", p);
            }
        }
    }
}
