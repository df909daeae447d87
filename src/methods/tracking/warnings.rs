//! Warnings about a tracked sequence: frames in which the object ends or begins, and those in which its
//! surface is uncertain.

use super::region::Region;
use super::{Cavity, FrameStatistics, SurfaceTracker};
use crate::mesh::{TriangleMesh, measure};
use crate::pauses::Pauses;
use crate::warning::{Place, Warning, WarningCode};

/// Largest accepted difference between the middles of the intensity steps at the surface in two frames of the same windows,
/// in units of the step of one. Votes are by the level of the window, which at this difference may be at a fifth of the step
/// instead of half; points are shifted by the levels of the frame, but by half a voxel at most. With a smaller limit, frames
/// of a cine sequence are warned of.
const MAX_SHIFT: f64 = 0.3;

/// Thickness of the object, 2V/A with its volume V and area A as of a plate, in units of the radius of the plane fits, below which its
/// volume is uncertain: planes fitted to half of a ball and more do not show its curvature. Of a ball it is ⅔ of the radius,
/// and at this thickness its error is 5 %; of square bars half of their side, and errors are up to 8 % a little above it.
const THIN: f64 = 0.93;

/// Thickness of the object, as above, in units of the distance of slices that are [`THICK`], below which its volume is uncertain:
/// of a ball of this thickness it is 6 % too small in slices eight pixels thick, 3 % in slices four thick.
const THIN_IN_SLICES: f64 = 1.65;

/// Ratio of the longest to the shortest side of a voxel from which slices are thick.
const THICK: f64 = 3.0;

/// Ratio of the intensity step at the surface to the largest one of other frames below which the surface is uncertain: of a
/// beating ball, blurred over 2.5 voxels, whose image fades by 15 % per frame, volumes are then 4 to 8 % too small.
const FADED: f64 = 2.0 / 3.0;

/// Share of the vertices of a surface in the sides of the box, or near them, from which it is cut off there: fewer touch it.
const CUT: f64 = 0.01;

/// Distance from a side of the box, in voxels, up to which a vertex is in it.
const NEAR_SIDE: f64 = 0.6;

/// Share of the vertices without a boundary from which a surface is uncertain; surfaces between chambers have a tenth.
const WITHOUT_BOUNDARY: f64 = 0.3;

/// Ratio of the volume of a frame to those of both frames beside it from which it is no motion of an object; in a heartbeat of
/// eight frames it is 1.8.
const JUMP: f64 = 2.0;

/// Share of the bright voxels within a surface from which a part of them that is apart counts: smaller ones are fragments or noise.
const PART: f64 = 0.1;

/// Level from which voxels within a surface are bright, as a share of the intensity step at the surface: those of a neck, which
/// are partly dark, connect its ends.
const BRIGHT: f64 = 0.3;

/// Facts for warnings about the surface in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SurfaceFacts {
    /// Number of handles.
    genus: u32,
    /// Whether a side of the box cuts the object.
    is_cut: bool,
    /// Whether the object within the surface has more parts than the surface.
    is_divided: bool,
    /// Whether another object touches it that was apart in the frame before.
    is_touched: bool,
}

/// Something that may be true of several frames, which one warning then tells of.
struct Finding {
    code: WarningCode,
    text: String,
    /// The frames of which it is true, in their order.
    frames: Vec<usize>,
}

impl Finding {
    fn warning(&self, frame: usize, text: String) -> Warning {
        Warning::at(self.code, Place::Frame(frame as u32), text)
    }

    /// Returns a warning about all of its frames, placed in the first of them; `None` without any.
    fn of_all(self) -> Option<Warning> {
        let first = *self.frames.first()?;
        let text = match self.frames.len() {
            1 => self.text.clone(),
            count => format!("{} ({count} frames, from this one on)", self.text),
        };
        Some(self.warning(first, text))
    }

    /// Returns a warning about a frame; `None` if it is none of its frames.
    fn of_frame(self, frame: usize) -> Option<Warning> {
        self.frames.contains(&frame).then(|| self.warning(frame, self.text.clone()))
    }
}

impl SurfaceTracker {
    /// Returns what a user should know about the frames tracked so far: each finding once, in the first frame of which it is
    /// true.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings: Vec<_> =
            (0..self.meshes.len()).flat_map(|frame| self.warnings_of_one(frame)).collect();
        warnings.extend(self.cycle_warning());
        warnings.extend(self.findings().into_iter().filter_map(Finding::of_all));
        warnings
    }

    /// Returns what a user should know about a frame, among them what is also true of others.
    pub fn warnings_in(&self, frame: usize) -> Vec<Warning> {
        if frame >= self.meshes.len() {
            return Vec::new();
        }
        let mut warnings = self.warnings_of_one(frame);
        warnings.extend(self.cycle_warning().filter(|_| frame == 0));
        warnings.extend(self.findings().into_iter().filter_map(|finding| finding.of_frame(frame)));
        warnings
    }

    /// Returns the warnings that are about a single frame.
    fn warnings_of_one(&self, frame: usize) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let before = match frame.checked_sub(1) {
            Some(before) => self.has_object(before),
            None => self.start.vertex_count() > 0,
        };
        let (is_there, is_lost) = (self.has_object(frame), self.lost.contains(&(frame as u32)));
        if before && (!is_there || is_lost) {
            warnings.push(ends(frame));
        }
        if is_there && frame > 0 && (!before || is_lost) {
            warnings.push(if is_lost { begins_anew(frame) } else { begins(frame) });
        }
        if is_there {
            warnings.extend(self.uncertain_size(frame));
            warnings.extend(self.volume_jump(frame));
        }
        warnings
    }

    /// Returns what may be true of several frames, some of it of none.
    fn findings(&self) -> [Finding; 7] {
        let finding = |code, text, is_true: fn(&SurfaceFacts) -> bool| {
            let frames = self.facts.iter().enumerate().filter(|(_, facts)| is_true(facts));
            Finding { code, text, frames: frames.map(|(frame, _)| frame).collect() }
        };
        let handles = has_handles(self.cavity, self.is_ring());
        let touched = self.touched_frames();
        [
            self.missing_boundary(),
            self.few_slices(),
            self.faded(),
            finding(WarningCode::TouchesBox, CUT_BY_BOX.into(), |facts| facts.is_cut),
            finding(WarningCode::Parts, DIVIDED.into(), |facts| facts.is_divided),
            Finding { code: WarningCode::Parts, text: TOUCHED.into(), frames: touched },
            finding(WarningCode::Handles, handles, |facts| facts.genus > 0),
        ]
    }

    /// Returns the frames whose surface another object touches, or did before: it may hold that from then on, until it ends.
    fn touched_frames(&self) -> Vec<usize> {
        let mut is_touched = false;
        let mut touched = Vec::new();
        for (frame, facts) in self.facts.iter().enumerate() {
            let goes_on = self.has_object(frame) && !self.lost.contains(&(frame as u32));
            is_touched = facts.is_touched || is_touched && goes_on;
            if is_touched {
                touched.push(frame);
            }
        }
        touched
    }

    /// Finds the frames in which the image shows no boundary at much of the surface.
    fn missing_boundary(&self) -> Finding {
        let shares = self.statistics.iter().enumerate().map(|(frame, statistics)| {
            // Closed surfaces have about twice as many triangles as vertices.
            (frame, 2.0 * statistics.without_boundary as f64 / statistics.triangles.max(1) as f64)
        });
        let much: Vec<_> = shares.filter(|(_, share)| *share > WITHOUT_BOUNDARY).collect();
        let percent = 100.0 * WITHOUT_BOUNDARY;
        let text = format!(
            "the image shows no boundary at more than {percent:.0} % of the surface; it is a guess there: lower the edge \
             threshold, or use another box"
        );
        let frames = much.into_iter().map(|(frame, _)| frame).collect();
        Finding { code: WarningCode::NoBoundary, text, frames }
    }

    /// Returns a warning if the volume differs too much from those of both frames beside it.
    fn volume_jump(&self, frame: usize) -> Option<Warning> {
        let [before, now, after] = [frame.checked_sub(1)?, frame, frame + 1].map(|t| {
            self.statistics.get(t).map(|statistics| statistics.volume).filter(|volume| *volume > 0.0)
        });
        let (before, now, after) = (before?, now?, after?);
        let jumps = now * JUMP < before.min(after) || now > JUMP * before.max(after);
        jumps.then(|| {
            let text = format!(
                "the volume is {now:.4e} between {before:.4e} and {after:.4e} in the frames beside it: the surface may have \
                 lost a part of the object, or taken in another"
            );
            Warning::at(WarningCode::VolumeJump, Place::Frame(frame as u32), text)
        })
    }

    /// Returns the facts about the surface `mesh` of a frame, with the intensities at it.
    pub(super) async fn measured_facts(
        &self,
        frame: usize,
        mesh: &TriangleMesh,
        intensities: Option<[f64; 2]>,
        pauses: &Pauses,
    ) -> SurfaceFacts {
        if mesh.triangles.is_empty() {
            return SurfaceFacts::default();
        }
        let measured = measure(mesh);
        pauses.after(mesh.positions.len()).await;
        let genus = (2 * measured.components as i64 - measured.euler) / 2;
        let in_side = mesh.positions.iter().filter(|&&p| {
            let at = self.region.to_local(p * self.region.space.scale as f32);
            self.region.is_near_side(at, NEAR_SIDE)
        });
        let share = in_side.count() as f64 / mesh.positions.len() as f64;
        let parts = self.parts_within(frame, mesh, intensities, pauses).await;
        let is_divided = parts > measured.components;
        let is_touched = self.is_touched(frame, mesh, intensities, pauses).await;
        SurfaceFacts { genus: genus.max(0) as u32, is_cut: share >= CUT, is_divided, is_touched }
    }

    /// Returns the number of parts of the bright voxels within a surface of a frame.
    async fn parts_within(
        &self,
        frame: usize,
        mesh: &TriangleMesh,
        intensities: Option<[f64; 2]>,
        pauses: &Pauses,
    ) -> usize {
        let Some([bright, dark]) = intensities else { return 0 };
        let (region, level) = (&self.region, dark + BRIGHT * (bright - dark));
        let inside = self.voxels_within(mesh);
        pauses.now().await;
        let image = region.frames[frame].iter().enumerate();
        let mask: Vec<bool> =
            image.map(|(i, &value)| inside.contains(i) && f64::from(value) > level).collect();
        pauses.now().await;
        let (parts, count) = region.lattice().parts(&mask, pauses).await;
        let mut sizes = vec![0usize; count + 1];
        parts.iter().filter(|part| **part > 0).for_each(|&part| sizes[part as usize] += 1);
        let all: usize = sizes.iter().sum();
        sizes.iter().filter(|&&size| size as f64 > PART * all as f64).count()
    }

    /// Whether the surface has as many handles in all frames so far, as an object that is a ring.
    fn is_ring(&self) -> bool {
        let genus = |facts: &SurfaceFacts| facts.genus;
        self.facts.first().map(genus) > Some(0)
            && self.facts.iter().all(|facts| facts.genus == self.facts[0].genus)
    }

    fn has_object(&self, frame: usize) -> bool {
        !self.meshes[frame].triangles.is_empty()
    }

    /// Returns the warning about the first frame of a cyclic sequence, which follows the last, once the run is done.
    fn cycle_warning(&self) -> Option<Warning> {
        self.cycle_closure_error?;
        let last = self.meshes.len().checked_sub(1)?;
        match [self.has_object(last), self.has_object(0)] {
            [true, false] => Some(ends(0)),
            [false, true] => Some(begins(0)),
            _ => None,
        }
    }

    /// Returns a warning if the intensities at the surface differ too much from those in another frame of the windows.
    fn uneven_brightness(&self, frame: usize) -> Option<Warning> {
        let [inside, outside] = self.intensities_at_surface[frame]?;
        let middle = |[inside, outside]: [f64; 2]| (inside + outside) / 2.0;
        let near = self.voting.window().frames_around(frame, self.frames());
        let others = near.iter().filter_map(|&t| *self.intensities_at_surface.get(t)?);
        let shift = others.map(|other| (middle(other) - middle([inside, outside])).abs()).fold(0.0, f64::max);
        (shift > MAX_SHIFT * (inside - outside)).then(|| {
            let text = format!(
                "intensities at the surface differ from those in a frame nearby by {:.1} times the step there, so the \
                 surface may be off; equalise the brightness of the frames, or set windowFrames to 0",
                shift / (inside - outside)
            );
            Warning::at(WarningCode::UnevenBrightness, Place::Frame(frame as u32), text)
        })
    }

    /// Returns a warning if the object is too small or thin for the radius of the plane fits.
    fn small_object(&self, frame: usize) -> Option<Warning> {
        let thickness = self.thickness(frame);
        (thickness < THIN * self.params.radius).then(|| {
            let text = format!(
                "the object is about as thin as a plate of {thickness:.3e} or a ball of radius {:.3e}, too thin for plane fits \
                 of radius {:.3e}, so its volume is uncertain",
                1.5 * thickness,
                self.params.radius
            );
            Warning::at(WarningCode::SmallObject, Place::Frame(frame as u32), text)
        })
    }

    /// Returns the thickness of the object in a frame, 2V/A; 0 without an object.
    fn thickness(&self, frame: usize) -> f64 {
        let FrameStatistics { volume, area, .. } = self.statistics[frame];
        if area > 0.0 { 2.0 * volume.max(0.0) / area } else { 0.0 }
    }

    /// Returns a warning if the object is too small, or else if its brightness differs too much from that in frames nearby.
    fn uncertain_size(&self, frame: usize) -> Option<Warning> {
        // Steps at the surface of a small object are not those of its boundary.
        self.small_object(frame).or_else(|| self.uneven_brightness(frame))
    }

    /// Finds the frames in which the object extends over few thick slices, without those in which it is too small anyway.
    fn few_slices(&self) -> Finding {
        let [distance, pixel] =
            [self.region.longest_side() / self.region.space.scale, self.region.shortest_side()];
        let is_thin = |frame: &usize| self.thickness(*frame) < THIN_IN_SLICES * distance;
        let is_told = |frame: &usize| self.small_object(*frame).is_some();
        let frames = (0..self.meshes.len()).filter(|frame| self.has_object(*frame));
        let frames = frames.filter(|frame| distance >= THICK * pixel && is_thin(frame) && !is_told(frame));
        Finding { code: WarningCode::SmallObject, text: FEW_SLICES.into(), frames: frames.collect() }
    }

    /// Finds the frames in which the intensity step at the surface is much lower than the highest step. Frames with a warning
    /// about their size or brightness are left out: their step is not that of the object's boundary.
    fn faded(&self) -> Finding {
        let steps = self.intensities_at_surface.iter().enumerate().filter_map(|(frame, intensities)| {
            intensities.map(|[inside, outside]| (frame, inside - outside))
        });
        let steps: Vec<_> = steps.filter(|(frame, _)| self.uncertain_size(*frame).is_none()).collect();
        let largest = steps.iter().map(|(_, step)| *step).fold(0.0, f64::max);
        let low = steps.into_iter().filter(|(_, step)| *step < FADED * largest);
        let frames = low.map(|(frame, _)| frame).collect();
        Finding { code: WarningCode::UnevenBrightness, text: FADED_STEP.into(), frames }
    }

    /// Returns the mean intensities at the surface `mesh` of a frame, see [`intensities_at`].
    pub(super) fn measured_intensities(&self, frame: usize, mesh: &TriangleMesh) -> Option<[f64; 2]> {
        let mut mesh = mesh.clone();
        mesh.positions.iter_mut().for_each(|p| *p *= self.region.space.scale as f32);
        intensities_at(&self.region, frame, &mesh)
    }
}

/// Returns the mean intensities one voxel inside and one voxel outside of a surface, given in the working space, in steps of
/// the quantised intensities. Vertices at which intensity rises outwards, or beyond the box, are left out; `None` if
/// there are no others.
fn intensities_at(region: &Region, frame: usize, mesh: &TriangleMesh) -> Option<[f64; 2]> {
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for (p, normal) in mesh.positions.iter().zip(mesh.vertex_normals()) {
        let (at, out) = (region.to_local(*p), region.from_space.transform_vector3(normal.as_dvec3()));
        let out = out.normalize_or_zero() * region.spacing.min_element();
        if region.clamp_into_box(at + out).is_some() {
            continue;
        }
        let [inside, outside] = [at - out, at + out].map(|at| region.sample(frame, at));
        if inside > outside {
            (sums, count) = ([sums[0] + inside, sums[1] + outside], count + 1.0);
        }
    }
    (count > 0.0).then(|| sums.map(|sum| sum / count))
}

const CUT_BY_BOX: &str = "the box cuts the object: its volume is that within the box; use a larger box";

const FEW_SLICES: &str = "the object extends over few slices, so its volume is some percent off: insert slices between \
                          them, which halves that";

const FADED_STEP: &str = "the intensity step at the surface is less than two thirds of that in another frame, so the surface may \
                          be off; equalise the brightness of the frames, or lower the edge threshold";

const DIVIDED: &str = "the object is in several parts within one surface: it has divided, or another touched it before; volume \
                       and area hold what joins the parts: track them one by one, each from where it is alone";

const TOUCHED: &str = "another object touches the one that is tracked, or did before; the image shows them as one, so the surface \
                       may hold both, or a part of the other: use a box without it, or frames in which they are apart";

fn has_handles(cavity: Cavity, is_ring: bool) -> String {
    if is_ring {
        return "the surface has as many handles as in all other frames: that is right for a ring, but else noise, or \
                muscles that cross the object"
            .into();
    }
    let close = if cavity == Cavity::Open { "close its cavity, " } else { "" };
    format!(
        "the surface has handles: muscles that cross the object, or noise; {close}raise the edge threshold, or use a larger \
         window"
    )
}

fn ends(frame: usize) -> Warning {
    let text = "the surface ends: the image has no boundary of the object here; it is gone, too small, has moved too far, or has \
                divided";
    Warning::at(WarningCode::EndsInFrame, Place::Frame(frame as u32), text)
}

fn begins_anew(frame: usize) -> Warning {
    let text = "a surface begins in place of the one before: the object has moved further than the windows reach, has \
                divided, or is another; vertices do not correspond to those in the frames before";
    Warning::at(WarningCode::BeginsInFrame, Place::Frame(frame as u32), text)
}

fn begins(frame: usize) -> Warning {
    let text = "a surface begins: in the frame before, the image had no such object, or one too small";
    Warning::at(WarningCode::BeginsInFrame, Place::Frame(frame as u32), text)
}
