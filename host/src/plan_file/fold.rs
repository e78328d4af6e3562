//! The passes of many frames, folded to those of one.

use super::Specialised;
use super::document::{ChangeEntry, FieldEntry, PassEntry};
use crate::plan::{BufferId, Pass};
use restir_kernels::KernelDesc;
use restir_shared::layout::{CameraParams, Field, Kind, fields_of};
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

    /// The kernels of all passes, in the order in which they are needed.
    pub(super) fn kernels(&self) -> Vec<Specialised> {
        let mut kernels: Vec<Specialised> = Vec::new();
        for (_, pass) in self.0.iter().filter_map(|folded| folded.runs.first()) {
            if !kernels.iter().any(|kernel| is_of(pass, kernel)) {
                kernels.push((pass.kernel, pass.constants.clone()));
            }
        }
        kernels
    }

    /// The entries; `kernels` are those of [`Self::kernels`], and `cameras` has that of each frame.
    pub(super) fn entries(&self, kernels: &[Specialised], cameras: &[CameraParams]) -> Vec<PassEntry> {
        self.0.iter().filter_map(|folded| entry(&folded.runs, kernels, cameras)).collect()
    }
}

fn alike(a: &Pass, b: &Pass) -> bool {
    a.kernel.name == b.kernel.name && a.constants == b.constants && a.grid == b.grid
}

fn is_of(pass: &Pass, (kernel, constants): &Specialised) -> bool {
    pass.kernel.name == kernel.name && pass.constants == *constants
}

fn entry(runs: &[(u32, Pass)], kernels: &[Specialised], cameras: &[CameraParams]) -> Option<PassEntry> {
    let (_, first) = runs.first()?;
    let ids = |role: usize| cycle(&runs.iter().map(|(_, pass)| pass.bindings[role]).collect::<Vec<BufferId>>());
    let buffers: BTreeMap<String, Vec<BufferId>> =
        (0..).zip(first.bindings()).map(|(role, (binding, _))| (binding.name.to_owned(), ids(role))).collect();
    Some(PassEntry {
        kernel: kernels.iter().position(|kernel| is_of(first, kernel))?,
        frames: ranges(runs.iter().map(|(frame, _)| *frame)),
        buffers,
        grid: first.grid,
        workgroups: first.workgroups(),
        params: first.params.clone(),
        changes: fields(first.kernel).into_iter().filter_map(|field| change(field, runs, cameras)).collect(),
    })
}

/// What a field holds in each run, if it changes.
fn change(field: FieldEntry, runs: &[(u32, Pass)], cameras: &[CameraParams]) -> Option<ChangeEntry> {
    let FieldEntry { name, byte, count, .. } = field;
    let words = |pass: &Pass| pass.params.iter().skip(byte as usize / 4).take(count as usize).copied().collect();
    let all: Vec<(u32, Vec<u32>)> = runs.iter().map(|(frame, pass)| (*frame, words(pass))).collect();
    let values = cycle(&all.iter().map(|(_, words)| words.clone()).collect::<Vec<_>>());
    let follows = if values.len() > 1 { follows(&name, &all, cameras).map(str::to_owned) } else { None };
    (values.len() > 1).then_some(ChangeEntry { field: name, byte, values, follows })
}

/// What a field follows, if it is that in all of the frames. The first frame has no last one.
fn follows(name: &str, all: &[(u32, Vec<u32>)], cameras: &[CameraParams]) -> Option<&'static str> {
    let last_part = name.rsplit('.').next().unwrap_or(name);
    let of_camera =
        fields_of::<CameraParams>().iter().find(|field| field.name == last_part && name.contains("camera."));
    let in_camera = |frame: u32| {
        let (first, words) = of_camera.map(|field| (field.byte as usize / 4, field.kind.words()))?;
        let camera: &[u32] = bytemuck::cast_slice(std::slice::from_ref(cameras.get(frame as usize)?));
        camera.get(first..first + words as usize).map(<[u32]>::to_vec)
    };
    let is = |expected: &dyn Fn(u32) -> Option<Vec<u32>>| {
        all.iter().all(|(frame, words)| expected(*frame).as_ref() == Some(words))
    };
    let was = |expected: &dyn Fn(u32) -> Option<Vec<u32>>| {
        all.iter().filter(|(frame, _)| *frame > 0).all(|(frame, words)| expected(frame - 1).as_ref() == Some(words))
    };
    let number = |frame: u32| Some(vec![frame]);
    let known = [
        ("camera", is(&in_camera)),
        ("last_camera", was(&in_camera)),
        ("frame", is(&number)),
        ("last_frame", was(&number)),
    ];
    known.into_iter().find(|(_, holds)| *holds).map(|(what, _)| what)
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
        let kernels = fold.kernels();
        let entries = fold.entries(&kernels, &[]);
        let frames: Vec<_> = entries.iter().map(|entry| (entry.kernel, entry.frames.clone())).collect();
        assert_eq!(frames, [(0, vec![[2, 2]]), (1, vec![[1, 3]]), (0, vec![[0, 1], [3, 3]])]);
        let last = &entries[2];
        assert_eq!((&last.buffers["left"], &last.buffers["right"]), (&vec![0, 1, 1], &vec![1, 0, 0]));
        assert_eq!((last.grid, last.workgroups), ([9, 5], [2, 1, 1]));
        let [change] = &last.changes[..] else { panic!("{:?}", last.changes) };
        assert_eq!((change.field.as_str(), change.byte), ("samples", 8));
        assert_eq!(change.values, [1.0_f32, 2.0, 4.0].map(|samples| vec![samples.to_bits()]));
    }
}
