//! Blocks of a film, merged as soon as they are siblings in its tree.

use restir_shared::layout::FilmPixel;

/// The sums of consecutive aligned blocks: no two of them are siblings.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    /// (first index, log2 of how many, sums)
    nodes: Vec<(u32, u32, Vec<FilmPixel>)>,
}

impl Tree {
    /// Adds the block after the last one.
    pub(super) fn push(&mut self, first: u32, log2: u32, sums: Vec<FilmPixel>) {
        let mut node = (first, log2, sums);
        while let Some(left) = self.nodes.pop_if(|left| left.1 == node.1 && left.0.trailing_zeros() > left.1) {
            node = (left.0, left.1 + 1, added(left.2, &node.2));
        }
        self.nodes.push(node);
    }

    /// The sum of all, in the order in which a film adds what is not aligned: from the smallest block up.
    pub(super) fn sum(self) -> Vec<FilmPixel> {
        let sums = self.nodes.into_iter().rev().map(|(_, _, sums)| sums);
        sums.reduce(|right, left| added(left, &right)).unwrap_or_default()
    }

    /// The blocks and their sums.
    pub(super) fn into_blocks(self) -> (Vec<(u32, u32)>, Vec<Vec<FilmPixel>>) {
        self.nodes.into_iter().map(|(first, log2, sums)| ((first, log2), sums)).unzip()
    }
}

fn added(mut left: Vec<FilmPixel>, right: &[FilmPixel]) -> Vec<FilmPixel> {
    left.iter_mut().zip(right).for_each(|(left, right)| *left = left.merge(*right));
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(index: u32) -> FilmPixel {
        FilmPixel { sum: [1.0 / (index + 1) as f32, 0.1, 0.0], dropped: 1.0 }
    }

    /// Sums by the definition, from above.
    fn of(first: u32, count: u32) -> FilmPixel {
        if count == 1 {
            return sample(first);
        }
        let half = if count.is_power_of_two() { count / 2 } else { 1 << count.ilog2() };
        of(first, half).merge(of(first + half, count - half))
    }

    #[test]
    fn sums_do_not_depend_on_how_samples_come_together() {
        for count in 1..70 {
            for split in 0..count {
                let mut tree = Tree::default();
                let ranges = [(0, split), (split, count - split)]
                    .map(|(first, len)| crate::film::aligned_blocks(first, len, 31));
                for (first, log2) in ranges.into_iter().flatten() {
                    tree.push(first, log2, vec![of(first, 1 << log2)]);
                }
                assert_eq!(tree.nodes.len() as u32, count.count_ones());
                assert_eq!(tree.sum(), [of(0, count)], "{split} of {count}");
            }
        }
        // the order counts: this would be seen
        assert_ne!((0..13).map(sample).reduce(FilmPixel::merge), Some(of(0, 13)));
    }

    #[test]
    fn blocks_that_only_have_a_size_in_common_stay_apart() {
        let mut tree = Tree::default();
        (1..4).for_each(|index| tree.push(index, 0, vec![sample(index)]));
        let (blocks, _) = tree.into_blocks();
        assert_eq!(blocks, [(1, 0), (2, 1)]);
    }
}
