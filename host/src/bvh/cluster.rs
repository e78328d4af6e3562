//! Clusters of boxes, merged from the leaves up: PLOC (Meister and Bittner 2018, "Parallel Locally-Ordered Clustering for Bounding
//! Volume Hierarchy Construction") as `obvhs` has it, with one rule more. Its rounds merge two nodes if each is the other's best
//! partner nearby. In a row of equal steps, in a nest of boxes or in a crowd of coincident ones almost every node prefers one that
//! prefers another, a round merges a single pair, and the time grows with the square of their number. Here a round that merges
//! too few pairs what is left in the order along the curve, so that there are O(log n) rounds whatever the shapes.

use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::morton::morton_encode_u64_unorm;
use obvhs::{Boundable, aabb::Aabb};

/// How far along the curve a node looks for its partner.
const SEARCH: usize = 14;
/// A round has to merge one in so many nodes. Where triangles lie anyhow, a round merges a third of them.
const LEAST_MERGED: usize = 16;

/// A binary tree with one box a leaf, and the most nodes that were left when a round merged too few: 0 where triangles lie anyhow.
/// In the first `quick_rounds`, which have the most nodes, a node looks only at the ones beside it.
pub(super) fn tree(boxes: &[impl Boundable], quick_rounds: usize) -> (Bvh2, usize) {
    let mut bvh = Bvh2::zeroed(boxes.len());
    bvh.primitive_indices = (0..boxes.len() as u32).collect();
    bvh.children_are_ordered_after_parents = true;
    let mut nodes = along_curve(boxes);
    // children are put from the end on, in pairs; the root takes what is left, the first place
    let mut free = bvh.nodes.len();
    let mut round = 0;
    let mut stalled = 0;
    while nodes.len() > 1 {
        let search = if round < quick_rounds { 1 } else { SEARCH };
        let mut partners = mutual(&best_partners(&nodes, search));
        if partners.iter().flatten().count() < nodes.len() / LEAST_MERGED {
            pair_neighbours(&mut partners);
            stalled = stalled.max(nodes.len());
        }
        nodes = merged(&nodes, &partners, &mut bvh.nodes, &mut free);
        round += 1;
    }
    bvh.nodes[..1].copy_from_slice(&nodes);
    bvh.max_depth = bvh.max_depth.max(round + 1);
    (bvh, stalled)
}

/// Leaves in the order of their centres along a Morton curve through the box of all.
fn along_curve(boxes: &[impl Boundable]) -> Vec<Bvh2Node> {
    let all = boxes.iter().fold(Aabb::empty(), |all, one| all.union(&one.aabb()));
    let scale = 1.0 / all.diagonal().as_dvec3();
    let offset = -all.min.as_dvec3() * scale;
    let code = |aabb: Aabb| morton_encode_u64_unorm(aabb.center().as_dvec3() * scale + offset);
    let mut places: Vec<(u64, u32)> = boxes.iter().map(|one| code(one.aabb())).zip(0..).collect();
    places.sort_unstable();
    places.into_iter().map(|(_, index)| Bvh2Node::new(boxes[index as usize].aabb(), 1, index)).collect()
}

/// For each node that one of at most `search` places away with which it has the smallest box, the last of several.
fn best_partners(nodes: &[Bvh2Node], search: usize) -> Vec<usize> {
    let mut best = vec![(f32::INFINITY, 0); nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let aabb = node.aabb();
        let mut own = best[index];
        let end = (index + search + 1).min(nodes.len());
        for other in index + 1..end {
            let cost = aabb.union(nodes[other].aabb()).half_area();
            if cost <= own.0 {
                own = (cost, other);
            }
            if cost <= best[other].0 {
                best[other] = (cost, index);
            }
        }
        best[index] = own;
    }
    best.into_iter().map(|(_, partner)| partner).collect()
}

/// The partners that prefer each other; the second of them names the place of the first.
fn mutual(best: &[usize]) -> Vec<Option<usize>> {
    let chosen = |(index, &partner): (usize, &usize)| (partner < index && best[partner] == index).then_some(partner);
    best.iter().enumerate().map(chosen).collect()
}

/// Gives those without a partner each other, in their order.
fn pair_neighbours(partners: &mut [Option<usize>]) {
    let mut alone: Vec<bool> = partners.iter().map(Option::is_none).collect();
    partners.iter().flatten().for_each(|&first| alone[first] = false);
    let left: Vec<usize> = (0..partners.len()).filter(|&index| alone[index]).collect();
    left.chunks_exact(2).for_each(|pair| partners[pair[1]] = Some(pair[0]));
}

/// The nodes after a round: a parent stands where the second of its children stood.
fn merged(nodes: &[Bvh2Node], partners: &[Option<usize>], tree: &mut [Bvh2Node], free: &mut usize) -> Vec<Bvh2Node> {
    let mut firsts = vec![false; nodes.len()];
    partners.iter().flatten().for_each(|&first| firsts[first] = true);
    let mut parent = |children: [Bvh2Node; 2]| {
        *free -= 2;
        tree[*free..*free + 2].copy_from_slice(&children);
        Bvh2Node::new(children[0].aabb().union(children[1].aabb()), 0, *free as u32)
    };
    let kept = nodes.iter().zip(partners).zip(&firsts).filter(|(_, first)| !**first);
    kept.map(|((&node, partner), _)| partner.map_or(node, |first| parent([node, nodes[first]]))).collect()
}
