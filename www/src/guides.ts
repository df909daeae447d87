const DOCS = './docs/';

/** What the documentation beside the app begins with. */
export const DOCUMENTATION = `${DOCS}index.html`;

/** Its pages on what each lab does, for who has not met the method before. */
export const GUIDES = {
  extract: `${DOCS}documents/A_surface_out_of_a_volume.html`,
  reconstruct: `${DOCS}documents/A_surface_out_of_points.html`,
  track: `${DOCS}documents/A_surface_through_time.html`,
  sculpt: `${DOCS}documents/A_surface_under_your_hand.html`,
};

/** Its section on what a surface can miss. */
export const COVERAGE_GUIDE = `${GUIDES.extract}#what-a-surface-can-miss-and-why`;
