import { LANGUAGE, text } from '../texts';
import '../kit/style.css';
import { h } from '../kit/dom';
import { mayLose } from '../kit/question';
import { sentencesOf } from '../lab/work';
import { chooseLanguage, LANGUAGES } from '../texts/language';
import { Keeping } from './keeping';
import { KeptWork } from './kept-work';
import { Labs } from './labs';
import { workOffline } from './offline';
import { announcePage } from './pages';

/** Offers the lessons: a button shows and hides their panel, whose code is fetched when it is first needed. */
function offerLessons(lab: HTMLElement, opener: HTMLElement, panel: HTMLElement): void {
  const address = new URL(location.href).searchParams.get('lesson');
  const show = (shown: boolean) => {
    panel.hidden = !shown;
    opener.setAttribute('aria-expanded', String(shown));
    if (!shown) opener.focus();
  };
  let begun = false;
  const open = async () => {
    show(true);
    if (begun) return;
    begun = true;
    const { LessonPanel } = await import('../lessons/panel');
    const lessons = new LessonPanel(panel, lab, () => show(false));
    await (address ? lessons.open(address) : lessons.showList());
  };
  opener.textContent = text('shell.lessons');
  opener.addEventListener('click', () => (panel.hidden ? void open() : show(false)));
  if (address) void open();
}

function offerLanguages(select: HTMLElement, keeping: Keeping): void {
  const options = Object.entries(LANGUAGES).map(([id, name]) =>
    h('option', { value: id, lang: id, selected: id === LANGUAGE }, name),
  );
  select.replaceChildren(...options);
  select.setAttribute('aria-label', text('shell.language'));
  select.title = text('shell.languageHelp');
  select.addEventListener('change', () => {
    const list = select as HTMLSelectElement;
    const chosen = list.value;
    list.value = LANGUAGE;
    const losses = [text('shell.languageConfirm'), ...sentencesOf(keeping.lostWithPage)];
    void mayLose(text('work.leave'), losses, text('work.leaveGo')).then((may) => {
      if (!may) return;
      keeping.mayLose = true;
      chooseLanguage(chosen);
    });
  });
}

function openLabs(): void {
  const element = (id: string) => document.getElementById(id) ?? document.body;
  const [lab, help, nav] = [element('lab'), element('help'), element('labs')];
  nav.setAttribute('aria-label', text('shell.labs'));
  help.textContent = text('shell.shortcuts');
  help.setAttribute('aria-label', text('shell.shortcutsLabel'));
  const newTab = h('span', { class: 'visually-hidden' }, text('shell.newTab'));
  element('guide').replaceChildren(text('shell.guide'), newTab);
  offerLessons(lab, element('lessons'), element('lesson'));
  announcePage();
  const keeping = new Keeping();
  const labs = new Labs(lab, help, nav, keeping);
  offerLanguages(element('language'), keeping);
  new KeptWork(keeping, labs, element('notice'));
  window.addEventListener('beforeunload', (event) => {
    if (keeping.lostWithPage.length > 0) event.preventDefault();
  });
  // Browsers on phones end pages that are hidden without a word.
  document.addEventListener('visibilitychange', () => void keeping.now());
}

document.documentElement.lang = LANGUAGE;
const { searchParams } = new URL(location.href);
const view = searchParams.get('view');
if (view)
  void import('../lessons/sheet').then(({ showSheet }) =>
    showSheet(searchParams.get('lesson') ?? '', view === 'teacher'),
  );
else openLabs();
workOffline();
