//! The node hierarchy: parents before children, local transforms in f64, no recursion.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::document::{Document, Node};
use crate::load::source::shorten;
use crate::load::{LoadError, LoadLimits, Warnings};

/// `parent_from_node`, kept in parts where the file has parts: only those can be animated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Local {
    /// Translation, rotation, scale.
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
    /// Any affine map, shear included.
    Matrix(DAffine3),
}

impl Local {
    /// No transform.
    pub const IDENTITY: Local = Local::Parts { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// As one map.
    pub fn to_affine(self) -> DAffine3 {
        match self {
            Local::Parts { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
            Local::Matrix(affine) => affine,
        }
    }

    fn of(node: &Node, at: &str, warnings: &mut Warnings) -> Result<Local, LoadError> {
        let local = match node.matrix {
            Some(matrix) => Local::Matrix(affine_of(matrix, at, warnings)),
            None => Local::Parts {
                translation: node.translation.map_or(DVec3::ZERO, DVec3::from),
                rotation: rotation_of(node.rotation, at, warnings),
                scale: node.scale.map_or(DVec3::ONE, DVec3::from),
            },
        };
        if node.matrix.is_some() && (node.translation.is_some() || node.rotation.is_some() || node.scale.is_some()) {
            warnings.add(format!("{at}: has a matrix beside translation, rotation or scale; the matrix counts"));
        }
        if local.to_affine().is_finite() {
            Ok(local)
        } else {
            Err(LoadError::malformed(at, "its transform is not finite"))
        }
    }
}

fn affine_of(matrix: [f64; 16], at: &str, warnings: &mut Warnings) -> DAffine3 {
    let matrix = DMat4::from_cols_array(&matrix);
    if matrix.row(3) != glam::DVec4::W {
        warnings.add(format!("{at}.matrix: the last row is not 0 0 0 1 and is ignored"));
    }
    DAffine3 { matrix3: DMat3::from_mat4(matrix), translation: matrix.w_axis.truncate() }
}

fn rotation_of(rotation: Option<[f64; 4]>, at: &str, warnings: &mut Warnings) -> DQuat {
    /// The tolerance of the Khronos validator.
    const UNIT_TOLERANCE: f64 = 0.00674;
    let Some(rotation) = rotation.map(DQuat::from_array) else { return DQuat::IDENTITY };
    let length = rotation.length();
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        warnings.add(format!("{at}.rotation: of length {length}, not 1; it is normalized"));
    }
    if length > 0.0 && length.is_finite() { rotation / length } else { DQuat::IDENTITY }
}

/// All nodes of a document as a forest.
#[derive(Debug, Clone)]
pub(super) struct Hierarchy {
    /// Every node once, parents before their children.
    pub order: Vec<usize>,
    /// By node.
    pub parents: Vec<Option<usize>>,
    /// By node: rest pose.
    pub locals: Vec<Local>,
}

impl Hierarchy {
    /// Fails on cycles, on nodes with two parents and on chains deeper than the limit.
    pub fn of(document: &Document, limits: &LoadLimits, warnings: &mut Warnings) -> Result<Hierarchy, LoadError> {
        let count = document.nodes.len();
        LoadError::check_limit("nodes", count as u64, limits.nodes)?;
        let mut parents = vec![None; count];
        for (index, node) in document.nodes.iter().enumerate() {
            for &child in &node.children {
                let at = || format!("nodes[{index}].children");
                let parent = parents.get_mut(child).ok_or_else(|| {
                    LoadError::malformed(at(), format!("node {child} does not exist, there are {count}"))
                })?;
                if let Some(other) = parent.replace(index) {
                    return Err(LoadError::malformed(at(), format!("node {child} is a child of node {other} too")));
                }
            }
        }
        let order = Hierarchy::order(document, &parents, limits)?;
        let locals = document
            .nodes
            .iter()
            .enumerate()
            .map(|(index, node)| Local::of(node, &format!("nodes[{index}]"), warnings))
            .collect::<Result<_, _>>()?;
        Ok(Hierarchy { order, parents, locals })
    }

    fn order(document: &Document, parents: &[Option<usize>], limits: &LoadLimits) -> Result<Vec<usize>, LoadError> {
        let count = parents.len();
        let mut order: Vec<usize> = (0..count).filter(|&node| parents[node].is_none()).collect();
        let mut depths = vec![1_u64; count];
        let mut next = 0;
        while let Some(&node) = order.get(next) {
            LoadError::check_limit(format!("depth of nodes[{node}] in the hierarchy"), depths[node], limits.depth)?;
            for &child in &document.nodes[node].children {
                depths[child] = depths[node] + 1;
                order.push(child);
            }
            next += 1;
        }
        if order.len() < count {
            // What no root leads to hangs on a cycle: going up from any of it ends in one.
            let mut reached = vec![false; count];
            order.iter().for_each(|&node| reached[node] = true);
            let mut node = reached.iter().position(|reached| !reached).expect("a node is missing in the order");
            for _ in 0..count {
                node = parents[node].expect("only roots have no parent, and they are reached");
            }
            return Err(LoadError::malformed(format!("nodes[{node}]"), "the node is its own ancestor"));
        }
        Ok(order)
    }

    /// `world_from_node` of every node, given their local transforms.
    pub fn worlds(&self, locals: &[Local]) -> Vec<DAffine3> {
        let mut worlds = vec![DAffine3::IDENTITY; locals.len()];
        for &node in &self.order {
            let local = locals[node].to_affine();
            worlds[node] = self.parents[node].map_or(local, |parent| worlds[parent] * local);
        }
        worlds
    }

    /// Marks those below marked nodes too.
    pub fn spread_down(&self, marked: &mut [bool]) {
        for &node in &self.order {
            if let Some(parent) = self.parents[node] {
                marked[node] |= marked[parent];
            }
        }
    }

    /// The nodes of the document's default scene, or of all roots where it has no scenes; parents first.
    pub fn visible(&self, document: &Document, warnings: &mut Warnings) -> Result<Vec<usize>, LoadError> {
        let chosen = document.scene.unwrap_or(0);
        let Some(scene) = document.scenes.get(chosen) else {
            if document.scene.is_some() {
                let fault = format!("scene {chosen} does not exist, there are {}", document.scenes.len());
                return Err(LoadError::malformed("scene", fault));
            }
            if !self.order.is_empty() {
                warnings.add("the file has no scene: all nodes are shown");
            }
            return Ok(self.order.clone());
        };
        if document.scenes.len() > 1 {
            let name = scene.name.as_deref().map_or(String::new(), |name| format!(" {:?}", shorten(name)));
            warnings.add(format!("scene {chosen}{name} of {} is shown, the others are not", document.scenes.len()));
        }
        let mut marked = vec![false; self.order.len()];
        for &root in &scene.nodes {
            let at = format!("scenes[{chosen}].nodes");
            let count = self.order.len();
            let mark = marked.get_mut(root).ok_or_else(|| {
                LoadError::malformed(at.as_str(), format!("node {root} does not exist, there are {count}"))
            })?;
            if *mark {
                warnings.add(format!("{at}: node {root} is listed twice, and shown once"));
            }
            *mark = true;
            if let Some(parent) = self.parents[root] {
                warnings.add(format!("{at}: node {root} is not a root but a child of node {parent}"));
            }
        }
        self.spread_down(&mut marked);
        Ok(self.order.iter().copied().filter(|&node| marked[node]).collect())
    }
}
