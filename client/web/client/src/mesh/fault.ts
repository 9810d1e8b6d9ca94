/** What is wrong with a file, in one sentence that names the place. */
export class FileFault extends Error {
  override readonly name = "FileFault";
}
