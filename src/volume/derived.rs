//! Which warnings of a volume still hold for a volume that was made from it.

use super::{Region, Volume};
use crate::math::DVec3;
use crate::warning::{Place, Warning, WarningCode};

/// How a volume was made from another one.
#[derive(Clone, Copy)]
pub(super) enum Derivation {
    /// The same voxels, or a mask decided voxel by voxel: all warnings still hold.
    Same,
    /// A box of the voxels, in the voxel indices of the other volume: all warnings still hold, except at points outside
    /// of the box.
    Box(Region),
    /// One frame: warnings about other frames no longer hold, and those about this one are about all of it.
    Frame(usize),
    /// Voxels between those of the other volume, computed from them. That the shape between its slices is a guess holds
    /// still: the guess is now in the voxels.
    Interpolated,
    /// Means of blocks of voxels. Nothing was guessed, so whether its voxels are too long is a question about the new
    /// ones, which is answered where it matters.
    Averaged,
    /// Other values on its grid. Only what is about the place of the grid holds.
    Grid,
}

impl Volume {
    /// Returns this volume with the unit of the one that it was made from, and those of its warnings that still hold.
    pub(super) fn derived(mut self, from: &Volume, how: Derivation) -> Volume {
        self.unit = from.unit;
        self.warnings = from.warnings.iter().filter_map(|warning| from.kept(warning, how)).collect();
        self
    }

    /// Returns a warning of this volume for one that is made of it; `None` if it no longer holds.
    fn kept(&self, warning: &Warning, how: Derivation) -> Option<Warning> {
        let holds = match how {
            Derivation::Same | Derivation::Interpolated | Derivation::Frame(_) => true,
            Derivation::Box(region) => self.is_in(region, warning.place),
            Derivation::Averaged => warning.code != WarningCode::Anisotropic,
            Derivation::Grid => warning.code == WarningCode::Recentred,
        };
        let kept = holds.then(|| warning.clone())?;
        match (how, kept.place) {
            (Derivation::Frame(index), Some(Place::Frame(frame))) => {
                (index == frame as usize).then_some(Warning { place: None, ..kept })
            }
            _ => Some(kept),
        }
    }

    /// Returns whether a place is in a region, or no point.
    fn is_in(&self, region: Region, place: Option<Place>) -> bool {
        let Some(Place::Point(point)) = place else { return true };
        let index = self.inverse.transform_point3(DVec3::from(point)).to_array();
        (0..3).all(|axis| {
            let first = region.min[axis] as f64;
            (first - 0.5..=first + region.dims[axis] as f64 - 0.5).contains(&index[axis])
        })
    }

    /// Returns this volume, which consists of the frames of several ones, with their warnings: each once if all of them
    /// have it, else with the frames that it is about.
    pub(super) fn with_warnings_of(mut self, parts: &[Volume]) -> Volume {
        let mut first = 0;
        for part in parts {
            for warning in &part.warnings {
                let is_common = warning.place.is_none() && parts.iter().all(|p| p.warnings.contains(warning));
                for warning in if is_common { vec![warning.clone()] } else { part.moved(warning, first) } {
                    if !self.warnings.contains(&warning) {
                        self.warnings.push(warning);
                    }
                }
            }
            first += part.frames();
        }
        self
    }

    /// Returns a warning of this volume for a sequence in which the frames of this one begin at `first`.
    fn moved(&self, warning: &Warning, first: usize) -> Vec<Warning> {
        let frames = match warning.place {
            Some(Place::Frame(frame)) => frame as usize..frame as usize + 1,
            Some(_) => return vec![warning.clone()],
            None => 0..self.frames(),
        };
        let at = |frame: usize| Some(Place::Frame((first + frame) as u32));
        frames.map(|frame| Warning { place: at(frame), ..warning.clone() }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::volume::{Enrichment, Interpolation, ResampleGrid, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn at(code: WarningCode, place: Option<Place>) -> Warning {
        Warning { place, ..Warning::new(code, "Something.") }
    }

    /// Returns a volume of two frames with a warning of each kind that volumes have.
    fn volume() -> Volume {
        let init = VolumeInit {
            affine: DAffine3::from_scale(DVec3::new(1.0, 1.0, 2.0)),
            ..VolumeInit::new(Voxels::U8((0..128).collect()), [4, 4, 4, 2])
        };
        [
            at(WarningCode::Reader, None),
            at(WarningCode::Reader, Some(Place::Frame(1))),
            at(WarningCode::Reader, Some(Place::Point([3.0, 3.0, 6.0]))),
            at(WarningCode::Anisotropic, None),
            at(WarningCode::Recentred, None),
        ]
        .into_iter()
        .fold(Volume::new(init).unwrap(), Volume::with_warning)
    }

    fn kept(volume: &Volume) -> Vec<(WarningCode, Option<Place>)> {
        volume.warnings().iter().map(|w| (w.code, w.place)).collect()
    }

    #[test]
    fn a_volume_made_from_another_keeps_the_warnings_that_still_hold() {
        use WarningCode::{Anisotropic, Reader, Recentred};
        let v = volume();
        let all = kept(&v);
        let without =
            |code, place| -> Vec<_> { all.iter().copied().filter(|&one| one != (code, place)).collect() };
        let point = Some(Place::Point([3.0, 3.0, 6.0]));
        assert_eq!(kept(&v.crop([0; 3], [4; 3]).unwrap()), all);
        assert_eq!(kept(&v.crop([0; 3], [3; 3]).unwrap()), without(Reader, point));
        assert_eq!(kept(&v.threshold(3.0, 9.0).unwrap()), all);
        assert_eq!(kept(&v.frame(0).unwrap()), without(Reader, Some(Place::Frame(1))));
        let second =
            [(Reader, None), (Reader, None), (Reader, point), (Anisotropic, None), (Recentred, None)];
        assert_eq!(kept(&v.frame(1).unwrap()), second);
        assert_eq!(kept(&v.enrich_slices(Some(2), Enrichment::Linear).unwrap()), all);
        let dims = ResampleGrid::Dims([8, 8, 8]);
        assert_eq!(kept(&v.resample(dims, Interpolation::Linear).unwrap()), all);
        assert_eq!(kept(&v.binned([2, 2, 1]).unwrap()), without(Anisotropic, None));
        assert_eq!(kept(&v.pyramid(2, 2.0).unwrap()[1]), without(Anisotropic, None));
        assert_eq!(kept(&v.with_voxels(Voxels::U8(vec![1; 64])).unwrap()), [(Recentred, None)]);
    }

    #[test]
    fn a_sequence_has_the_warnings_of_its_parts_with_their_frames() {
        let plain = |frames| {
            Volume::new(VolumeInit::new(Voxels::U8(vec![1; 8 * frames]), [2, 2, 2, frames])).unwrap()
        };
        let common = at(WarningCode::Anisotropic, None);
        let of_one = at(WarningCode::Reader, None);
        let parts = [
            plain(1).with_warning(common.clone()),
            plain(2).with_warning(common.clone()).with_warning(of_one),
            plain(2).with_warning(common).with_warning(at(WarningCode::Precision, Some(Place::Frame(1)))),
        ];
        let joined = Volume::from_frames(&parts, None).unwrap();
        let frame = |n| Some(Place::Frame(n));
        assert_eq!(
            kept(&joined),
            [
                (WarningCode::Anisotropic, None),
                (WarningCode::Reader, frame(1)),
                (WarningCode::Reader, frame(2)),
                (WarningCode::Precision, frame(4)),
            ]
        );
    }
}
