import "../src/io/worker_dom.js";

// What the writer of GLB in three.js wants of a browser, so that FBX, COLLADA and 3MF can be read without one.

class FileReaderInNode {
  result: ArrayBuffer | undefined;
  onloadend: () => void = () => undefined;

  readAsArrayBuffer(blob: Blob): void {
    void blob.arrayBuffer().then((buffer) => {
      this.result = buffer;
      this.onloadend();
    });
  }
}

Object.assign(globalThis, { FileReader: FileReaderInNode });
