// What the pages' own types do not say: packed libraries, and what the studio shows to tests and teachers' scripts.
declare module "blockly";
declare module "codemirror";
interface Window { studio: any }
