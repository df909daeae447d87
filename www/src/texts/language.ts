/** Names of the languages of the interface, each in itself. */
export const LANGUAGES = { en: 'English', de: 'Deutsch' };
export type Language = keyof typeof LANGUAGES;

/** Under this key the browser keeps the language that the user has chosen. */
const KEPT = 'vesicle.language';

const isLanguage = (name: string | null | undefined): name is Language =>
  name != null && Object.hasOwn(LANGUAGES, name);

/**
 * Returns the language of the page: of its address (`?lang=de`), or else the one chosen before; English on pages that do
 * not offer a choice, as their `data-languages` says. In workers it is that which they are named after, or else English.
 */
export function chosenLanguage(): Language {
  const { name } = globalThis as { name?: string };
  if (!('document' in globalThis)) return isLanguage(name) ? name : 'en';
  if (!('languages' in document.documentElement.dataset)) return 'en';
  const asked = new URL(location.href).searchParams.get('lang');
  const chosen = isLanguage(asked) ? asked : keptLanguage();
  return isLanguage(chosen) ? chosen : 'en';
}

function keptLanguage(): string | null {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}

/** Keeps a language for this and later visits, and loads the page again in it. */
export function chooseLanguage(language: string): void {
  const url = new URL(location.href);
  url.searchParams.delete('lang');
  try {
    localStorage.setItem(KEPT, language);
  } catch {
    url.searchParams.set('lang', language);
  }
  history.replaceState(null, '', url);
  location.reload();
}
