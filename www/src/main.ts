import './style.css';
import { ExtractLab } from './labs/extract';

/** The labs by the hash of the page's address; an unknown or empty hash opens the first. */
const LABS = { '#extract': ExtractLab } as const;

const lab = document.getElementById('lab');
const help = document.getElementById('help');
if (lab && help) {
  const Lab = LABS[location.hash as keyof typeof LABS] ?? ExtractLab;
  void new Lab(lab, help).start();
}
