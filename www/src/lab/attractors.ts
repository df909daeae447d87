/** Most attractors that a surface may have: each has a row of controls. */
export const MOST_ATTRACTORS = 500;
