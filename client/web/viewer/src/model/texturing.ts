/** Images on a mesh, and where each corner of its faces is in them. */
export interface Texturing {
  /** u and v of each place: shares of the image's width and height, from its upper left corner. */
  coordinates: Float32Array;
  /** For each corner of the mesh's faces its place. */
  corners: Uint32Array;
  /** Together they are all faces, in the order in which they are drawn. */
  layers: readonly TextureLayer[];
  /** The faces as they are drawn. Left out: in their own order. */
  order?: Uint32Array;
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

/** Each layer costs a call in every picture. */
const mostLayers = 512;

/**
 * The same with one layer for all faces that look alike. Throws an Error if more than 512 layers are left. The texturing must have
 * its faces in their own order.
 */
export function gathered({ layers, ...rest }: Texturing): Texturing {
  const alike = new Map<string, TextureLayer[]>();
  const images = new Map<Blob | undefined, number>();
  for (const layer of layers) {
    const { image, colour, isRepeated } = layer;
    if (!images.has(image)) images.set(image, images.size);
    const key = [images.get(image), ...colour, isRepeated].join(" ");
    const before = alike.get(key);
    if (before) before.push(layer);
    else alike.set(key, [layer]);
  }
  if (alike.size > mostLayers)
    throw new Error(`it has ${alike.size} different materials; this page shows ${mostLayers} at most.`);
  const order = new Uint32Array(layers.reduce((sum, { faceCount }) => sum + faceCount, 0));
  let end = 0;
  const together = [...alike.values()].map((parts) => {
    const firstFace = end;
    for (const part of parts) for (let k = 0; k < part.faceCount; ++k) order[end++] = part.firstFace + k;
    return { ...parts[0]!, firstFace, faceCount: end - firstFace };
  });
  return { ...rest, layers: together, order };
}
