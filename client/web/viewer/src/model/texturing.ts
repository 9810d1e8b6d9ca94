/** Images on a mesh, and where each corner of its faces is in them. */
export interface Texturing {
  /** u and v of each place: shares of the image's width and height, from its upper left corner. */
  coordinates: Float32Array;
  /** For each corner of the mesh's faces its place. */
  corners: Uint32Array;
  /** Together they are all faces, in their order. */
  layers: readonly TextureLayer[];
  /** Images that the file names and that are not there. */
  missing?: readonly string[];
}

/** Faces, one after the other, with one image. */
export interface TextureLayer {
  firstFace: number;
  faceCount: number;
  /** In a format that browsers show. Left out: there is none, and the colour is that of the faces. */
  image?: Blob;
  /** Linear red, green and blue, by which the image is multiplied. */
  colour: readonly [number, number, number];
  /** Whether it begins again beyond its edges. */
  isRepeated: boolean;
}
