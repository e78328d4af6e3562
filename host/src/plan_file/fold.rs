//! The passes of many frames, folded to those of one.

use super::document::{ChangeEntry, FieldEntry, PassEntry};
use crate::plan::{BufferId, Pass};
use restir_kernels::KernelDesc;
use restir_shared::layout::{Field, Kind};
use std::collections::BTreeMap;

/// Passes that are one to a reader, in the frames in which they run.
struct Folded {
    /// Frame and pass.
    runs: Vec<(u32, Pass)>,
}

/// Passes in the order in which a frame runs those that it has.
pub(super) struct Fold(Vec<Folded>);

impl Fold {
    /// Folds frames, from the last one and its last pass on: what the first frames lack, such as history, they lack at their beginning. Their order
    /// stays: each pass becomes a run of the last pass like it before the one behind it, or a pass of its own there.
    pub(super) fn of(frames: Vec<Vec<Pass>>) -> Self {
        let mut folded: Vec<Folded> = Vec::new();
        for (frame, passes) in (0..).zip(frames).collect::<Vec<_>>().into_iter().rev() {
            let mut end = folded.len();
            for pass in passes.into_iter().rev() {
                let is_alike = |folded: &Folded| folded.runs.first().is_some_and(|(_, first)| alike(first, &pass));
                let at = folded[..end].iter().rposition(is_alike).unwrap_or_else(|| {
                    folded.insert(end, Folded { runs: Vec::new() });
                    end
                });
                folded[at].runs.push((frame, pass));
                end = at;
            }
        }
        folded.iter_mut().for_each(|folded| folded.runs.reverse());
        Self(folded)
    }

    /// What runs first of each pass, in order.
    pub(super) fn firsts(&self) -> impl Iterator<Item = &Pass> {
        self.0.iter().filter_map(|folded| folded.runs.first()).map(|(_, pass)| pass)
    }

    /// The entries; `kernel` gives the index of a pass's kernel.
    pub(super) fn entries(&self, kernel: impl Fn(&Pass) -> usize) -> Vec<PassEntry> {
        self.0.iter().filter_map(|folded| entry(&folded.runs, &kernel)).collect()
    }
}

fn alike(a: &Pass, b: &Pass) -> bool {
    a.kernel.name == b.kernel.name && a.constants == b.constants && a.grid == b.grid
}

fn entry(runs: &[(u32, Pass)], kernel: &impl Fn(&Pass) -> usize) -> Option<PassEntry> {
    let (_, first) = runs.first()?;
    let ids = |role: usize| cycle(&runs.iter().map(|(_, pass)| pass.bindings[role]).collect::<Vec<BufferId>>());
    let buffers: BTreeMap<String, Vec<BufferId>> =
        (0..).zip(first.bindings()).map(|(role, (binding, _))| (binding.name.to_owned(), ids(role))).collect();
    let [x, y, _] = first.kernel.workgroup;
    Some(PassEntry {
        kernel: kernel(first),
        frames: ranges(runs.iter().map(|(frame, _)| *frame)),
        buffers,
        grid: first.grid,
        workgroups: [first.grid[0].div_ceil(x), first.grid[1].div_ceil(y), 1],
        params: first.params.clone(),
        changes: fields(first.kernel).into_iter().filter_map(|field| change(field, runs)).collect(),
    })
}

/// What a field holds in each run, if it changes.
fn change(field: FieldEntry, runs: &[(u32, Pass)]) -> Option<ChangeEntry> {
    let FieldEntry { name, byte, count, .. } = field;
    let words = |pass: &Pass| pass.params.iter().skip(byte as usize / 4).take(count as usize).copied().collect();
    let values: Vec<Vec<u32>> = cycle(&runs.iter().map(|(_, pass)| words(pass)).collect::<Vec<_>>());
    (values.len() > 1).then_some(ChangeEntry { field: name, byte, values })
}

/// The fields of a kernel's parameters that are no blocks.
pub(super) fn fields(kernel: &KernelDesc) -> Vec<FieldEntry> {
    let mut all = Vec::new();
    leaves(kernel.fields, "", 0, &mut all);
    all
}

fn leaves(fields: &[Field], around: &str, start: u32, all: &mut Vec<FieldEntry>) {
    for field in fields {
        let name = format!("{around}{}", field.name);
        let byte = start + field.byte;
        let mut leaf =
            |kind: &str, count| all.push(FieldEntry { name: name.clone(), byte, kind: kind.to_owned(), count });
        match field.kind {
            Kind::Unsigned(count) => leaf("u32", count),
            Kind::Floats(count) => leaf("f32", count),
            Kind::Block(fields) => leaves(fields, &format!("{name}."), byte, all),
        }
    }
}

/// The shortest list that gives the values when it is repeated.
fn cycle<T: PartialEq + Clone>(values: &[T]) -> Vec<T> {
    let repeats = |&length: &usize| values.iter().skip(length).eq(values.iter().take(values.len() - length));
    let length = (1..values.len()).find(repeats).unwrap_or(values.len());
    values[..length].to_vec()
}

/// Ranges of frames, first and last, that hold these, which rise.
fn ranges(frames: impl Iterator<Item = u32>) -> Vec<[u32; 2]> {
    let mut ranges: Vec<[u32; 2]> = Vec::new();
    for frame in frames {
        match ranges.last_mut() {
            Some([_, last]) if *last + 1 == frame => *last = frame,
            _ => ranges.push([frame, frame]),
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir_kernels::film::{film_add, film_resolve};
    use restir_shared::layout::FilmParams;

    #[test]
    fn lists_are_as_short_as_they_can_be() {
        assert_eq!(cycle(&[7, 7, 7]), [7]);
        assert_eq!(cycle(&[1, 2, 1, 2, 1]), [1, 2]);
        assert_eq!(cycle(&[1, 2, 3, 1]), [1, 2, 3]);
        assert_eq!(cycle(&[1, 1, 2]), [1, 1, 2]);
        assert_eq!(ranges([0, 1, 2, 5, 7, 8].into_iter()), [[0, 2], [5, 5], [7, 8]]);
    }

    /// A pass that some frames lack has a place between those around it, and its lists go on only when it runs.
    #[test]
    fn frames_with_other_passes_are_folded_in_their_order() {
        let params = |samples| FilmParams { width: 9, height: 5, samples, reserved: 0 };
        let add = |samples, left, right| {
            Pass::new(&film_add::DESC, &[], &params(samples), &[("left", left), ("right", right)]).expect("bound")
        };
        let resolve =
            |id| Pass::new(&film_resolve::DESC, &[], &params(1.0), &[("sum", id), ("mean", 9)]).expect("bound");
        let fold = Fold::of(vec![
            vec![add(1.0, 0, 1)],
            vec![resolve(2), add(2.0, 1, 0)],
            vec![add(3.0, 0, 1), resolve(4)],
            vec![resolve(3), add(4.0, 1, 0)],
        ]);
        let entries = fold.entries(|pass| usize::from(pass.kernel.name == "film_add"));
        let frames: Vec<_> = entries.iter().map(|entry| (entry.kernel, entry.frames.clone())).collect();
        assert_eq!(frames, [(1, vec![[2, 2]]), (0, vec![[1, 3]]), (1, vec![[0, 1], [3, 3]])]);
        let last = &entries[2];
        assert_eq!((&last.buffers["left"], &last.buffers["right"]), (&vec![0, 1, 1], &vec![1, 0, 0]));
        assert_eq!((last.grid, last.workgroups), ([9, 5], [2, 1, 1]));
        let [change] = &last.changes[..] else { panic!("{:?}", last.changes) };
        assert_eq!((change.field.as_str(), change.byte), ("samples", 8));
        assert_eq!(change.values, [1.0_f32, 2.0, 4.0].map(|samples| vec![samples.to_bits()]));
    }
}
