//! Places the meshes of a glTF scene: by its nodes, and by the instances of EXT_mesh_gpu_instancing.

use crate::error::Result;
use crate::fs::quote::count;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::words::index_of;
use gltf::accessor::Item;
use gltf::json::accessor::Accessor;
use gltf::json::{Index, Mesh, Node};
use s3d_geom::glam::{DMat4, DQuat, DVec3, DVec4};
use serde_json::Value;
use std::collections::HashSet;

/// The most meshes that are placed: 2.4 GB of transforms. A file can place one with a few bytes.
const MAX_INSTANCES: u64 = if cfg!(fuzzing) { 1 << 16 } else { 1 << 24 };

/// A mesh, placed in the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instance {
    pub(crate) mesh: Index<Mesh>,
    /// The transform from the node to the world of the file, in the file's axes.
    pub(crate) world_from_node: DMat4,
    /// Whether it has joints, which would move it.
    pub(crate) skinned: bool,
    /// The node that says which object it is: the nearest one that is labelled, up to the root, or else the
    /// node of the mesh.
    pub(crate) object: u32,
}

/// How exactly the positions of nodes are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    /// In `f32`, as the gltf crate reads them.
    OfFile,
    /// In `f64`, for scenes far from their origin.
    Exact,
}

/// Returns all meshes of the scene with their transforms, in the order of the nodes, parents first.
pub(crate) fn instances(
    document: &GltfDocument,
    precision: Precision,
    warnings: &mut Vec<String>,
) -> Result<Vec<Instance>> {
    let root = document.root();
    let mut unknown = Vec::new();
    document.check_extensions(root.extensions.as_ref().map(|e| &e.others), "the file", &mut unknown)?;
    let coarse = coarser_levels(&root.nodes);
    let mut placed = Vec::new();
    let mut total = 0u64;
    let mut hidden = 0;
    let mut coarser = 0;
    // A tree has each node once. A node that comes twice would make a circle, or instances without end.
    let mut visited = vec![false; root.nodes.len()];
    let mut checked = vec![false; root.meshes.len()];
    let mut stack: Vec<(Index<Node>, DMat4, Option<u32>)> = roots(document)?
        .into_iter()
        .rev()
        .map(|n| (n, DMat4::IDENTITY, None))
        .collect();

    while let Some((index, world_from_parent, object_above)) = stack.pop() {
        let node = document.get(index, "the scene", "node")?;
        if visited
            .get_mut(index.value())
            .is_none_or(|visited| std::mem::replace(visited, true))
        {
            return Err(document.fail(format!("node {index} is in the scene twice; nodes must form a tree")));
        }

        if coarse.contains(&index.value()) {
            coarser += 1;
            continue;
        }
        if extension(node, "KHR_node_visibility").is_some_and(|e| e.get("visible") == Some(&false.into())) {
            hidden += 1;
            continue;
        }

        let others = node.extensions.as_ref().map(|e| &e.others);
        document.check_extensions(others, &format!("node {index}"), &mut unknown)?;
        let place = document
            .exact_place(index.value())
            .filter(|_| precision == Precision::Exact);
        let world_from_node = world_from_parent
            * parent_from_node(node, place).ok_or_else(|| {
                document.fail(format!(
                    "node {index} has a transform that is not finite, or a rotation of length 0"
                ))
            })?;

        let words = document.words().get(index.value());
        let object = words
            .filter(|words| words.is_labelled())
            .map_or(object_above, |_| Some(index.value() as u32));
        if let Some(mesh) = node.mesh {
            check_mesh(document, mesh, &mut checked, &mut unknown)?;
            let many = extension(node, "EXT_mesh_gpu_instancing");
            let many = many.map(|many| Instancing::new(document, many, index)).transpose()?;
            total = total.saturating_add(many.as_ref().map_or(1, |many| many.length));
            // The count is checked before memory is reserved.
            if total > MAX_INSTANCES {
                return Err(document.fail(format!(
                    "node {index} makes {total} meshes in the scene, and {MAX_INSTANCES} are read at most: \
                     cut it in parts"
                )));
            }
            let object = object.unwrap_or(index.value() as u32);
            let instance = Instance { mesh, world_from_node, skinned: node.skin.is_some(), object };
            placed.push((instance, many));
        }

        stack.extend(
            node.children
                .iter()
                .flatten()
                .rev()
                .map(|&child| (child, world_from_node, object)),
        );
    }

    let instances = all_instances(document, placed)?;

    if hidden > 0 {
        warnings.push(format!(
            "{} and what is below left out: hidden by KHR_node_visibility",
            count(hidden, "node")
        ));
    }
    if coarser > 0 {
        warnings.push(format!("{} left out: coarser levels of others (MSFT_lod)", count(coarser, "node")));
    }
    if !unknown.is_empty() {
        warnings.push(format!("extensions of nodes and meshes that are not read: {}", unknown.join(", ")));
    }
    Ok(instances)
}

/// Returns the nodes at which the scene begins: the nodes of the default scene, or else of the first scene
/// that has nodes, or else all nodes that have no parent.
fn roots(document: &GltfDocument) -> Result<Vec<Index<Node>>> {
    let root = document.root();
    if let Some(scene) = root.scene {
        return Ok(document.get(scene, "the file", "scene")?.nodes.clone());
    }
    if let Some(scene) = root.scenes.iter().find(|scene| !scene.nodes.is_empty()) {
        return Ok(scene.nodes.clone());
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        if let Some(flag) = is_child.get_mut(child.value()) {
            *flag = true;
        }
    }
    Ok((0..)
        .zip(is_child)
        .filter(|(_, is_child)| !is_child)
        .map(|(n, _)| Index::new(n))
        .collect())
}

/// Checks the extensions of a mesh, once.
fn check_mesh(
    document: &GltfDocument,
    index: Index<Mesh>,
    checked: &mut [bool],
    unknown: &mut Vec<String>,
) -> Result<()> {
    let mesh = document.get(index, "a node", "mesh")?;
    if checked
        .get_mut(index.value())
        .is_none_or(|checked| std::mem::replace(checked, true))
    {
        return Ok(());
    }
    let who = format!("mesh {index}");
    document.check_extensions(mesh.extensions.as_ref().map(|e| &e.others), &who, unknown)?;
    for (p, primitive) in mesh.primitives.iter().enumerate() {
        let others = primitive.extensions.as_ref().map(|e| &e.others);
        document.check_extensions(others, &format!("{who}, primitive {p}"), unknown)?;
    }
    Ok(())
}

/// Places each mesh, and each instance of a mesh that has many.
fn all_instances(
    document: &GltfDocument,
    placed: Vec<(Instance, Option<Instancing>)>,
) -> Result<Vec<Instance>> {
    let mut instances = Vec::new();
    for (first, many) in placed {
        let Some(many) = many else {
            instances.push(first);
            continue;
        };
        let world_from_node = first.world_from_node;
        let transforms = many.node_from_instance(document)?.into_iter();
        instances
            .extend(transforms.map(|from| Instance { world_from_node: world_from_node * from, ..first }));
    }
    Ok(instances)
}

fn extension<'a>(node: &'a Node, name: &str) -> Option<&'a Value> {
    node.extensions.as_ref()?.others.get(name)
}

/// Returns the nodes that replace others at a distance. Source: the extension MSFT_lod.
fn coarser_levels(nodes: &[Node]) -> HashSet<usize> {
    let ids = nodes.iter().enumerate().flat_map(|(n, node)| {
        let ids = extension(node, "MSFT_lod").and_then(|lod| lod.get("ids")?.as_array());
        ids.into_iter()
            .flatten()
            .filter_map(index_of)
            .map(|id| id as usize)
            .filter(move |id| *id != n)
    });
    ids.collect()
}

/// The instances of a node's mesh. Source: the extension EXT_mesh_gpu_instancing, which has an attribute each
/// for translation, rotation and scale, all of one length.
struct Instancing {
    /// The name in messages.
    who: String,
    /// The accessor of each attribute, by name.
    accessors: Vec<(String, Index<Accessor>)>,
    length: u64,
}

impl Instancing {
    fn new(document: &GltfDocument, extension: &Value, node: Index<Node>) -> Result<Self> {
        let who = format!("node {node}, EXT_mesh_gpu_instancing");
        let attributes = extension.get("attributes").and_then(Value::as_object);
        let mut many = Self { who, accessors: Vec::new(), length: 0 };

        for (name, value) in attributes.into_iter().flatten() {
            let who = &many.who;
            let index: Option<Index<Accessor>> = index_of(value).map(Index::new);
            let index =
                index.ok_or_else(|| document.fail(format!("{who}: {name} is {value}, no accessor")))?;
            let accessor = document.get(index, who, "accessor")?;
            let n = accessor.count.0;
            // An element has at least one byte, so a mere claim makes no instances.
            let bytes = match accessor.buffer_view {
                Some(view) => document.view(view, who)?.len() as u64,
                None => 0,
            };
            if n > bytes {
                return Err(document.fail(format!("{who}: {name} has {n} elements in {bytes} bytes")));
            }
            if let Some((first, _)) = many.accessors.first().filter(|_| many.length != n) {
                let length = many.length;
                return Err(document.fail(format!("{who}: {length} of {first}, but {n} of {name}")));
            }
            many.length = n;
            many.accessors.push((name.clone(), index));
        }

        if many.accessors.is_empty() {
            return Err(document.fail(format!("{} has no attributes", many.who)));
        }
        Ok(many)
    }

    /// Reads an attribute, or repeats its default.
    fn read<const N: usize>(
        &self,
        document: &GltfDocument,
        name: &str,
        default: [f32; N],
    ) -> Result<Vec<[f32; N]>>
    where
        [i8; N]: Item,
        [u8; N]: Item,
        [i16; N]: Item,
        [u16; N]: Item,
        [u32; N]: Item,
        [f32; N]: Item,
    {
        match self.accessors.iter().find(|(n, _)| n == name) {
            Some((_, index)) => document.read_vectors(*index, &format!("{}, {name}", self.who)),
            None => Ok(vec![default; usize::try_from(self.length).unwrap_or(usize::MAX)]),
        }
    }

    /// Returns the transform from each instance to the node.
    fn node_from_instance(&self, document: &GltfDocument) -> Result<Vec<DMat4>> {
        let translations = self.read(document, "TRANSLATION", [0.0; 3])?;
        let rotations = self.read(document, "ROTATION", [0.0, 0.0, 0.0, 1.0])?;
        let scales = self.read(document, "SCALE", [1.0; 3])?;
        let places = translations.into_iter().zip(rotations).zip(scales).enumerate();
        let places = places.map(|(n, ((translation, rotation), scale))| {
            transform(exact(scale), rotation, exact(translation)).ok_or_else(|| {
                let who = &self.who;
                document.fail(format!(
                    "{who}: instance {n} has a transform that is not finite, or a rotation of length 0"
                ))
            })
        });
        places.collect()
    }
}

/// Returns the transform of a node. `place` is a more exact translation, if it is known.
fn parent_from_node(node: &Node, place: Option<DVec3>) -> Option<DMat4> {
    match node.matrix {
        Some(matrix) => {
            let mut matrix = DMat4::from_cols_array(&matrix.map(f64::from));
            if let Some(place) = place {
                matrix.w_axis = place.extend(matrix.w_axis.w);
            }
            Some(matrix).filter(|matrix| matrix.is_finite())
        }
        None => transform(
            node.scale.map_or(DVec3::ONE, exact),
            node.rotation.unwrap_or_default().0,
            place.unwrap_or_else(|| node.translation.map_or(DVec3::ZERO, exact)),
        ),
    }
}

/// Scales, then turns, then moves. Returns `None` if the transform is not finite or the rotation has no
/// length. Unit quaternions are normalised, since files round them to `f32` or to fewer bits.
fn transform(scale: DVec3, rotation: [f32; 4], translation: DVec3) -> Option<DMat4> {
    let rotation = DQuat::from_vec4(DVec4::from_array(rotation.map(f64::from)).try_normalize()?);
    let matrix = DMat4::from_scale_rotation_translation(scale, rotation, translation);
    matrix.is_finite().then_some(matrix)
}

fn exact(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}
