const DOCS = './docs/';

/** Start page of the documentation that is served with the app. */
export const DOCUMENTATION = `${DOCS}index.html`;

/** Documentation pages that introduce each lab to readers who are new to its method. */
export const GUIDES = {
  extract: `${DOCS}documents/A_surface_out_of_a_volume.html`,
  reconstruct: `${DOCS}documents/A_surface_out_of_points.html`,
  track: `${DOCS}documents/A_surface_through_time.html`,
  sculpt: `${DOCS}documents/A_surface_under_your_hand.html`,
};

/** Section of the documentation on what an extracted surface can miss. */
export const COVERAGE_GUIDE = `${GUIDES.extract}#what-a-surface-can-miss-and-why`;
