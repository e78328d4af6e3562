//! What techniques have in common whose pixels share in mutual pairs (`restir_shared::resample::mutual`): planes, passes, and their replay.

use super::chain::{Queue, Reuses};
use super::planes::{Planes, Turns};
use super::{Followed, Origin, PassParams, Replay, Reused};
use crate::Error;
use crate::plan::BufferId;
use crate::technique::sequence::Frame;
use restir_kernels::KernelDesc;
use restir_kernels::reuse::{reuse_pair, reuse_reproject};
use restir_shared::layout::CameraParams;
use restir_shared::resample::mutual::{Merged, Record, Shares, ShiftRequest, ShiftResult, merge};
use restir_shared::resample::params::{Flags, LastFrame, ReuseParams};
use restir_shared::resample::similar::PackedSurface;

/// Elements of the planes of requests and of their results, for each pixel.
#[derive(Clone, Copy)]
pub(crate) struct Layers {
    pub(crate) requests: usize,
    pub(crate) results: usize,
}

/// The kernels of a kind of record, and the planes that their passes name.
pub(crate) struct Mutual {
    shift: &'static KernelDesc,
    merge: &'static KernelDesc,
    origins: Turns,
    surfaces: Turns,
    results: Option<BufferId>,
    /// Results of requests the other way, with temporal reuse.
    returned: Option<BufferId>,
}

impl Mutual {
    /// Adds the planes of records `R` and origins `O`, of which neighbours of a pass are so many.
    pub(crate) fn new<R, O>(
        planes: &mut Planes,
        reuses: &Reuses,
        neighbours: u32,
        kernels: [&'static KernelDesc; 2],
    ) -> Self {
        // of each neighbour a layer: requests, and their results
        let layers = if reuses.in_space > 0 { neighbours as usize } else { usize::from(reuses.in_time) };
        Self::with_layers::<R, O>(planes, reuses, Layers { requests: layers, results: layers }, kernels)
    }

    /// The same with so many layers.
    pub(crate) fn with_layers<R, O>(
        planes: &mut Planes,
        reuses: &Reuses,
        layers: Layers,
        [shift, merge]: [&'static KernelDesc; 2],
    ) -> Self {
        let Reuses { in_time, in_space, feedback, .. } = *reuses;
        let pixels = planes.pixels;
        let results = (layers.results > 0).then(|| {
            planes.add::<ShiftRequest>("requests", layers.requests * pixels);
            planes.add::<ShiftResult>("results", layers.results * pixels)
        });
        let origins = planes.add_turns::<O>("origins", in_time);
        let surfaces = planes.add_turns::<PackedSurface>("surfaces", in_time);
        // one in work, one for the last frame's or for spatial reuse, and a third where both are needed at once
        let held = in_time && !feedback && in_space > 1;
        planes.add_records::<R>("reservoirs", 1 + usize::from(in_space > 0 || in_time) + usize::from(held));
        let returned = in_time.then(|| planes.add::<ShiftResult>("returned", pixels));
        if returned.is_none()
            && let Some(results) = results
        {
            planes.bind("returned", results);
        }
        Self { shift, merge, origins, surfaces, results, returned }
    }

    /// The planes of origins.
    pub(crate) fn origins(&self) -> Turns {
        self.origins.clone()
    }

    /// The plane of results, if there is one.
    pub(crate) fn results(&self) -> Option<BufferId> {
        self.results
    }

    /// Merges the last frame's records into those in work. `elsewhere` pushes what has to be done to the records of a plane before they are
    /// shifted to the other frame by a pass of these parameters, and gives the plane that has them then.
    pub(crate) fn in_time<P: PassParams>(
        &self,
        queue: &mut Queue,
        now: &Frame,
        params: &P,
        elsewhere: impl Fn(&mut Queue, &P, BufferId) -> BufferId,
    ) {
        let mut history = queue.history();
        if !params.flags.contains(Flags::STILL) {
            self.reproject(queue, now, params, &[]);
            history = self.exchange(queue, now, params, elsewhere);
        }
        self.merge_in_time(queue, now, params, history);
    }

    /// Asks for records of the last frame: of where pixels' surfaces were seen.
    pub(crate) fn reproject<P: PassParams>(
        &self,
        queue: &mut Queue,
        now: &Frame,
        params: &P,
        planes: &[(&'static str, BufferId)],
    ) {
        let before = ("other_surfaces", self.surfaces.before(now.index));
        queue.push(now, &reuse_reproject::DESC, &**params, &[&[before], planes].concat());
    }

    /// Shifts records between the last frame and this one, both ways, as was asked: the plane of the last frame's as they were shifted. See
    /// [`Self::in_time`].
    pub(crate) fn exchange<P: PassParams>(
        &self,
        queue: &mut Queue,
        now: &Frame,
        params: &P,
        elsewhere: impl Fn(&mut Queue, &P, BufferId) -> BufferId,
    ) -> BufferId {
        let Some(returned) = self.returned else { return queue.history() };
        let back = changed(params, |reuse| ReuseParams { flags: reuse.flags | Flags::BACK, ..*reuse });
        let own = elsewhere(queue, &back, queue.work());
        let origins = self.origins.before(now.index);
        queue.push(now, self.shift, &back, &[("reservoirs", own), ("origins", origins), ("results", returned)]);
        let history = elsewhere(queue, params, queue.history());
        queue.push(now, self.shift, params, &[("reservoirs", history)]);
        history
    }

    /// Merges the records of that plane, as they were shifted, into those in work.
    pub(crate) fn merge_in_time<P: PassParams>(&self, queue: &mut Queue, now: &Frame, params: &P, history: BufferId) {
        queue.push(now, self.merge, params, &[("reservoirs", history), ("merged", queue.work())]);
    }

    /// Merges the records of neighbours into the plane `merged` by the shifts of the spatial pass of that number, which was the last one.
    pub(crate) fn sum<P: PassParams>(&self, queue: &mut Queue, now: &Frame, params: &P, pass: u32, merged: BufferId) {
        let params = changed(params, |reuse| {
            let reuse = reuse.with_neighbours(pass);
            ReuseParams { flags: reuse.flags | Flags::SUMS, ..reuse }
        });
        queue.push(now, self.merge, &params, &[("reservoirs", queue.work()), ("merged", merged)]);
    }

    /// Merges the records of neighbours into the plane `merged`, by the spatial pass of that number.
    pub(crate) fn in_space<P: PassParams>(
        &self,
        queue: &mut Queue,
        now: &Frame,
        params: &P,
        pass: u32,
        merged: BufferId,
    ) {
        let params = changed(params, |reuse| reuse.with_neighbours(pass));
        queue.push(now, &reuse_pair::DESC, &params.with_layers(), &[]);
        self.share(queue, now, &params, merged);
    }

    /// Merges the records that were asked for, in a layer for each neighbour, into the plane `merged`.
    pub(crate) fn share<P: PassParams>(&self, queue: &mut Queue, now: &Frame, params: &P, merged: BufferId) {
        let (layers, records) = (changed(params, |reuse| reuse.with_layers()), ("reservoirs", queue.work()));
        queue.push(now, self.shift, &layers, &[records]);
        queue.push(now, self.merge, params, &[records, ("merged", merged)]);
    }
}

/// The same parameters with others of reuse.
fn changed<P: PassParams>(params: &P, change: impl Fn(&ReuseParams) -> ReuseParams) -> P {
    let mut params = *params;
    *params = change(&params);
    params
}

/// The parameters of passes between a frame and the last one, from those within the frame. With `may_stand_still` a view that does is merged
/// without shifts.
pub(crate) fn with_last<P: PassParams>(params: &P, now: &Frame, camera: CameraParams, may_stand_still: bool) -> P {
    let last = LastFrame { camera, scene: now.scenes[1], same_view: may_stand_still && now.is_still() };
    let change = if now.same_scene { Flags::default() } else { Flags::CHANGED };
    changed(params, |reuse| {
        let with_last = reuse.with_last(&last);
        ReuseParams { neighbours: 1, flags: with_last.flags | change, ..with_last }
    })
}

/// The plane in which a merge finds the pixels' own records.
pub(crate) fn role_of_own<R: Reused>(merge: &Followed<R>) -> &'static str {
    if merge.crosses() { "merged" } else { "reservoirs" }
}

/// Whether a pass merges shifted records: in a view that stands still none is shifted.
pub(crate) fn is_of_shifts<R: Reused>(pass: &Followed<R>) -> bool {
    pass.leaves_merged() && !pass.params.flags.contains(Flags::STILL)
}

/// How a merge is replayed.
///
/// # Errors
/// Those of [`Followed::read`].
pub(crate) fn replay<R: Reused + Record>(pass: &Followed<R>) -> Result<Replay<'_, R>, Error> {
    let (crosses, shifts, own) = (pass.crosses(), is_of_shifts(pass), role_of_own(pass));
    let (own, makers) = (pass.read::<R>(own)?, [pass.maker(own)?, pass.maker("reservoirs")?]);
    let shares = Shares {
        records: pass.read("reservoirs")?,
        requests: pass.read_if(shifts, "requests")?,
        results: pass.read_if(shifts, "results")?,
        returned: pass.read_if(shifts && crosses, "returned")?,
    };
    Ok(Box::new(move |pixel| {
        let Merged { record, is_other, request } =
            merge(&pass.params, &shares, own[pixel as usize], pass.position(pixel));
        let other = shares.requests.get(request as usize).map_or(pixel, |request: &ShiftRequest| request.sample);
        let (made_by, pixel) = (makers[usize::from(is_other)], if is_other { other } else { pixel });
        (record, Origin::Record { made_by, pixel, is_other, of_last_frame: is_other && crosses })
    }))
}
