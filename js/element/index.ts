/**
 * `<vesicle-lab>`: a surface that grows over data of yours, on any page, without a line of script.
 *
 * ```html
 * <script type="module" src="https://…/vesicle/element.js"></script>
 * <vesicle-lab src="head.nii.gz" method="deformable" levels="1" params='{ "iso": 95 }'></vesicle-lab>
 * ```
 *
 * Importing it defines the element. three.js is inside; the library itself is the one beside it, in a worker of its own.
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
