const DOCS = './docs/';

/** Address of the start page of the documentation that is served with the app. */
export const DOCUMENTATION = `${DOCS}index.html`;

/** Addresses, by lab, of the documentation pages that introduce the lab to readers who are new to its method. */
export const GUIDES = {
  extract: `${DOCS}documents/Surface_extraction_from_volumes.html`,
  reconstruct: `${DOCS}documents/Surface_reconstruction_from_points.html`,
  track: `${DOCS}documents/Surface_tracking_through_time.html`,
  segment: `${DOCS}documents/Segmentation_and_surfaces_of_label_maps.html`,
  sculpt: `${DOCS}documents/Freeform_deformation_of_detailed_surfaces.html`,
};

/** Address of the section of the documentation on what an extracted surface can miss, linked from the Extract lab. */
export const COVERAGE_GUIDE = `${GUIDES.extract}#what-a-surface-can-miss-and-why`;

/** Address of the documentation on writing lessons. */
export const LESSON_GUIDE = `${DOCS}documents/Lessons.html`;
