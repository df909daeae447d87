/**
 * Options of a test or a block that is too long for every change, and runs in `npm run test:all`, without those of its
 * file that are not long. It must not need them, nor may they need it; it may need long ones before it.
 */
export const LONG = { tags: ['long'] };

/**
 * Options of a test or a block of what the labs have in common: for every change it runs in one lab, and in the others
 * in `npm run test:all`.
 */
export const inOneLab = (lab: string) => (lab === 'extract' ? {} : LONG);
