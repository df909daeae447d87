const DOCS = './docs/';

/** Start page of the documentation that is served with the app. */
export const DOCUMENTATION = `${DOCS}index.html`;

/** Documentation pages that introduce each lab to readers who are new to its method. */
export const GUIDES = {
  extract: `${DOCS}documents/Surface_extraction_from_volumes.html`,
  reconstruct: `${DOCS}documents/Surface_reconstruction_from_points.html`,
  track: `${DOCS}documents/Surface_tracking_through_time.html`,
  sculpt: `${DOCS}documents/Freeform_deformation_of_detailed_surfaces.html`,
};

/** Section of the documentation on what an extracted surface can miss. */
export const COVERAGE_GUIDE = `${GUIDES.extract}#what-a-surface-can-miss-and-why`;
