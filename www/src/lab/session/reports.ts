import type { StepReport } from '../../engine/protocol';
import type { HistoryMark } from '../../kit/history';

/** Position in one of the lists of {@link ReportLists}. */
export interface PackedMark {
  list: number;
  iteration: number;
}

/** Lists of step reports, to which the marks of a session's saved states refer; most share one list. */
export class ReportLists {
  readonly lists: (readonly StepReport[])[];

  constructor(lists: (readonly StepReport[])[] = []) {
    this.lists = lists;
  }

  pack({ reports, iteration }: HistoryMark): PackedMark {
    const { length } = reports.filter((report) => report.iteration <= iteration);
    const known = this.lists.findIndex((list) => length === 0 || list[length - 1] === reports[length - 1]);
    if (known !== -1) return { list: known, iteration };
    return { list: this.lists.push(reports) - 1, iteration };
  }

  /** Returns the mark that was packed. */
  unpack({ list, iteration }: PackedMark): HistoryMark {
    return { reports: this.lists[list] ?? [], iteration };
  }
}
