/** The kinds of {@link Warning}. */
export type WarningCode =
  /** A part of the surface ends in this frame: the image has no object there from here on. */
  | 'ends-in-frame'
  /** A part of the surface begins in this frame: the image had no object there before. */
  | 'begins-in-frame'
  /** An intensity step at the surface that differs so much from that in other frames that the surface may be off. */
  | 'uneven-brightness'
  /** An object so small or thin, or over so few thick slices, that its volume is uncertain. */
  | 'small-object'
  /** The box in which the surface is tracked cuts the object. */
  | 'touches-box'
  /** A surface with handles, which most objects do not have. */
  | 'handles'
  /** An image without a boundary at much of the surface. */
  | 'no-boundary'
  /** An ellipsoid that stopped before its target, since the surface around it would have folded up. */
  | 'handle-stopped'
  /** A surface that intersects itself as given, and goes on to. */
  | 'self-intersecting'
  /** A volume that differs too much from those of the frames beside it. */
  | 'volume-jump'
  /** A label so thin that the volume of its surface is not that of its voxels. */
  | 'thin-label'
  /** Parts or gaps so thin that the points hardly tell them apart: topology and volume may be wrong. */
  | 'thin-parts'
  /** A surface that has not as many parts as the object: a divided one in one surface, one that another touches, or one that has come apart. */
  | 'parts'
  /** Normals that point inwards, so that inside and outside are exchanged. */
  | 'inward-normals'
  /** Points so far from the others that cells are too large for these. */
  | 'outliers'
  /** Positions or intensities that had to be rounded more than the result should suffer. */
  | 'precision'
  /** A surface that was moved towards the origin, since where it is it could not be represented. */
  | 'recentred'
  /** Voxels far longer along one axis, so that the shape between the slices is a guess. */
  | 'anisotropic'
  /** Something that the reader of the file noticed: an assumption that it made, or a part that it left out. */
  | 'reader';

/** Something to know about a volume or a result before relying on it. */
export interface Warning {
  /** The kind of warning, by which programs can distinguish them. */
  code: WarningCode;
  /** The warning in words: what was found, what was done, and what can be done about it. */
  text: string;
  /** The part of the data that is concerned, if it is not all of it: a frame, the value of a label, or a point. */
  where?: { frame: number } | { label: number } | { point: [number, number, number] };
}
