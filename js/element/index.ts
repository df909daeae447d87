/**
 * `<vesicle-lab>`: fits a surface to your data on any page, without scripting.
 *
 * ```html
 * <script type="module" src="https://…/vesicle/element.js"></script>
 * <vesicle-lab src="head.nii.gz" method="deformable" levels="1" params='{ "iso": 95 }'></vesicle-lab>
 * ```
 *
 * Importing the module defines the element. three.js is bundled; the library is loaded from beside it, into a worker.
 *
 * @packageDocumentation
 */
import { VesicleLab } from './lab.js';

export type { LabMethod, LabState } from './lab.js';
export { VesicleLab };

if (!customElements.get('vesicle-lab')) customElements.define('vesicle-lab', VesicleLab);

declare global {
  interface HTMLElementTagNameMap {
    'vesicle-lab': VesicleLab;
  }
}
