/** The Track lab's own part of a session. */
import { type Moments, mapMoments, packMoments, unpackMoments } from '../../lab/session/moments';
import type { TrackedFrame } from './protocol';
import type { TrackContent } from './schema';
import type { TrackMoment } from './settings';

/** Returns saved states as plain data, in which all share one list of tracked frames. */
export function packTrack(moments: Moments<TrackMoment>): Record<string, unknown> {
  const frames: TrackedFrame[] = [];
  const indexOf = (frame: TrackedFrame) => {
    const known = frames.indexOf(frame);
    return known === -1 ? frames.push(frame) - 1 : known;
  };
  const flat = ({ saved, page: { record } }: TrackMoment) => ({
    saved,
    page: { mark: record.mark, closing: record.closing, frames: record.frames.map(indexOf) },
  });
  return { ...packMoments(mapMoments(moments, flat)), frames };
}

/** Returns the saved states in the content of a session. */
export function unpackTrack({ frames: all, ...content }: TrackContent): Moments<TrackMoment> {
  return mapMoments(unpackMoments(content), ({ saved, page: { frames, ...page } }) => ({
    saved,
    page: { record: { ...page, frames: frames.flatMap((index) => all[index] ?? []) } },
  }));
}
