import './style.css';
import { ExtractLab } from './labs/extract';

/** The labs by the hash of the page's address; an unknown or empty hash opens the first. */
const LABS = { '#extract': ExtractLab } as const;

const lab = document.getElementById('lab');
const help = document.getElementById('help');
if (lab && help) {
  const Lab = LABS[location.hash as keyof typeof LABS] ?? ExtractLab;
  try {
    void new Lab(lab, help).start();
  } catch (error) {
    lab.dataset.state = 'error';
    lab.textContent = `This page needs WebGL 2 and Web Workers, and could not use them here: ${error instanceof Error ? error.message : error}`;
  }
}
