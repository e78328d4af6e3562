//! The planes of a chain of frames.

use crate::plan::{ARENAS, Buffer, BufferId};
use crate::technique::sequence::{Stage, Within};

/// The buffers of a chain. Each has a role, its name: in every pass that has such a role it is bound to it, unless the pass says otherwise.
pub(crate) struct Planes {
    /// Elements of a plane.
    pub(crate) pixels: usize,
    pub(super) buffers: Vec<Buffer>,
    roles: Vec<(&'static str, Turns)>,
    /// Planes of records: the one in work first, and that of the last frame last. Passes say which one they mean.
    pub(super) records: Vec<BufferId>,
    /// A technique that finds part of the light, whose buffers come before the chain's own.
    pub(super) within: Option<Within>,
}

impl Planes {
    /// The arenas, and the planes of the technique within, if there is one.
    pub(crate) fn new(stage: &Stage, within: Option<Within>) -> Self {
        let [width, height] = stage.size.map(|side| side as usize);
        let buffers = Within::buffers(within.as_ref(), stage);
        let roles = ARENAS.map(|(role, arena)| (role, Turns(vec![arena]))).into();
        Self { pixels: width * height, buffers, roles, records: Vec::new(), within }
    }

    /// Adds a buffer of `count` elements `T`.
    pub(crate) fn add<T>(&mut self, role: &'static str, count: usize) -> BufferId {
        let buffer = self.push::<T>(role, count);
        self.bind(role, buffer);
        buffer
    }

    /// Adds a plane of `T` for this frame and, with `history`, one for the last.
    pub(crate) fn add_turns<T>(&mut self, role: &'static str, history: bool) -> Turns {
        let turns = Turns((0..1 + u32::from(history)).map(|_| self.push::<T>(role, self.pixels)).collect());
        self.roles.push((role, turns.clone()));
        turns
    }

    /// Adds so many planes of records `T`, at least one.
    pub(crate) fn add_records<T>(&mut self, name: &'static str, count: usize) {
        self.records = (0..count).map(|_| self.push::<T>(name, self.pixels)).collect();
    }

    /// Lets `add` add buffers that no role is for.
    pub(crate) fn with_buffers<T>(&mut self, add: impl FnOnce(&mut Vec<Buffer>) -> T) -> T {
        add(&mut self.buffers)
    }

    /// Gives the buffer of that name, which is one of the technique within, its name as role.
    pub(crate) fn bind_within(&mut self, name: &'static str) {
        if let Some(buffer) = self.buffers.iter().position(|buffer| buffer.name == name) {
            self.bind(name, buffer);
        }
    }

    /// Gives a buffer one more role.
    pub(crate) fn bind(&mut self, role: &'static str, buffer: BufferId) {
        self.roles.push((role, Turns(vec![buffer])));
    }

    /// The roles of a frame's pass, of which some are bound.
    pub(super) fn bound(&self, frame: u32, bound: &[(&'static str, BufferId)]) -> Vec<(&'static str, BufferId)> {
        let others = self.roles.iter().filter(|(role, _)| bound.iter().all(|(other, _)| other != role));
        bound.iter().copied().chain(others.map(|(role, turns)| (*role, turns.of(frame)))).collect()
    }

    /// A plane of records beside the one in work that is not `held`.
    pub(super) fn free(&self, held: Option<BufferId>) -> Option<BufferId> {
        self.records[1..].iter().copied().find(|plane| Some(*plane) != held)
    }

    /// Puts a plane of records to a place, in exchange for the one there.
    pub(super) fn put(&mut self, plane: BufferId, place: usize) {
        if let Some(at) = self.records.iter().position(|other| *other == plane) {
            self.records.swap(at, place);
        }
    }

    fn push<T>(&mut self, name: &'static str, count: usize) -> BufferId {
        self.buffers.push(Buffer { name, words: count * size_of::<T>() / size_of::<u32>(), contents: None });
        self.buffers.len() - 1
    }
}

/// Planes that frames fill by turns.
#[derive(Clone)]
pub(crate) struct Turns(Vec<BufferId>);

impl Turns {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The plane of a frame.
    pub(crate) fn of(&self, frame: u32) -> BufferId {
        self.0[frame as usize % self.0.len()]
    }

    /// The plane of the frame before.
    pub(crate) fn before(&self, frame: u32) -> BufferId {
        self.of(frame.wrapping_add(1))
    }
}
