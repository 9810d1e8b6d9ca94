import * as three from "three";
import { type PaletteName, palettes } from "../model/palettes.js";
import type { ColourBy } from "../model/view.js";
import { type Ahead, place } from "./ahead.js";

// Lit from the camera and from above, in sRGB throughout: without conversions the surface has the legend's
// colours.

const light = `
/* How bright, and how shiny, a place is that looks along the normal, seen from toEye. */
vec2 lit(vec3 normal, vec3 toEye) {
  vec3 key = normalize(vec3(0.35, 0.75, 0.6));
  float facing = max(dot(normal, toEye), 0.0);
  float diffuse = 0.52 + 0.36 * max(dot(normal, key), 0.0) + 0.2 * facing + 0.1 * pow(1.0 - facing, 3.0);
  return vec2(diffuse, 0.16 * pow(max(dot(normal, normalize(key + toEye)), 0.0), 40.0));
}`;

/** What a ball of clay shows where its normal is this, seen from +z: a material whose light comes with the viewer (a “matcap”). */
const clay = `
vec3 clayAt(vec3 normal) {
  float lit = smoothstep(-0.55, 1.0, dot(normal, normalize(vec3(-0.35, 0.62, 0.7))));
  vec3 colour = mix(vec3(0.2, 0.09, 0.08), vec3(0.86, 0.55, 0.42), lit);
  colour += vec3(0.2, 0.23, 0.3) * smoothstep(0.55, 0.0, normal.z) * max(0.4 - normal.y, 0.0);
  return colour + 0.28 * pow(max(dot(normal, normalize(vec3(-0.3, 0.5, 0.81))), 0.0), 28.0);
}`;

const vertexShader = `
attribute float value;
#ifdef TEXTURED
attribute vec2 place;
varying vec2 vPlace;
#endif
varying float vValue;
#ifdef PER_VERTEX
varying vec2 vLit;
#else
varying vec3 vNormal;
varying vec3 vToEye;
#endif
${light}
${place}
void main() {
  vec4 seen = modelViewMatrix * vec4(placed(), 1.0);
  vValue = value;
#ifdef TEXTURED
  vPlace = place;
#endif
#ifdef PER_VERTEX
  vec3 toEye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-seen.xyz);
  vec3 facing = normalize(normalMatrix * normal);
  vLit = lit(dot(facing, toEye) < -0.1 ? -facing : facing, toEye);
#else
  vNormal = normalMatrix * normal;
  vToEye = isOrthographic ? vec3(0.0, 0.0, 1.0) : -seen.xyz;
#endif
  gl_Position = projectionMatrix * seen;
}`;

const fragmentShader = `
uniform float red;
uniform float low;
uniform float logarithmic;
uniform float colourful;
uniform vec3 plain;
uniform vec3 stops[5];
varying float vValue;
#ifdef TEXTURED
uniform sampler2D image;
varying vec2 vPlace;
#endif
#ifdef PER_VERTEX
varying vec2 vLit;
#else
varying vec3 vNormal;
varying vec3 vToEye;
#endif
${light}
${clay}
vec3 colourFor(float t) {
  float scaled = clamp(t, 0.0, 1.0) * 4.0;
  if (scaled < 1.0) return mix(stops[0], stops[1], scaled);
  if (scaled < 2.0) return mix(stops[1], stops[2], scaled - 1.0);
  if (scaled < 3.0) return mix(stops[2], stops[3], scaled - 2.0);
  return mix(stops[3], stops[4], scaled - 3.0);
}

void main() {
  float share = logarithmic > 0.5 ? log(vValue / low) / log(red / low) : (vValue - low) / max(red - low, 1e-30);
  vec3 colour = colourful > 0.5 ? colourFor(red > low ? share : 0.0) : plain;
#ifdef TEXTURED
  colour *= texture2D(image, vPlace).rgb;
#endif
#ifdef PER_VERTEX
  vec2 brightness = vLit;
#else
  vec3 normal = normalize(gl_FrontFacing ? vNormal : -vNormal);
  vec2 brightness = lit(normal, normalize(vToEye));
#ifdef BY_NORMAL
  colour = 0.5 + 0.5 * normal;
#endif
#ifdef CLAY
  vec3 toEye = normalize(vToEye);
  vec3 right = normalize(vec3(toEye.z, 0.0, -toEye.x));
  colour = clayAt(vec3(dot(normal, right), dot(normal, cross(toEye, right)), dot(normal, toEye)));
  brightness = vec2(1.0, 0.0);
#endif
#endif
  gl_FragColor = vec4(colour * (gl_FrontFacing ? brightness.x : 0.55 * brightness.x) + brightness.y, 1.0);
}`;

/**
 * `isPerVertex`: lighting is computed per vertex instead of per pixel. If the processor draws, that takes half the time, and it
 * is visible only on coarse meshes. `isClosed`: the inside is never visible, so it is not drawn.
 */
export function surfaceMaterial(isPerVertex: boolean, isClosed: boolean, ahead: Ahead): three.ShaderMaterial {
  return new three.ShaderMaterial({
    vertexShader,
    fragmentShader,
    defines: isPerVertex ? { PER_VERTEX: "" } : {},
    side: isClosed ? three.FrontSide : three.DoubleSide,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: {
      ahead,
      red: { value: 1 },
      low: { value: 0 },
      logarithmic: { value: 0 },
      colourful: { value: 1 },
      plain: { value: new three.Vector3(0.72, 0.75, 0.8) },
      stops: { value: vectorsOf("blueToRed") },
    },
  });
}

/** Colours by what is known for each pixel: by normals, or as clay; otherwise by values. */
export function colourByPixel(material: three.ShaderMaterial, by: ColourBy, isPerVertex: boolean): void {
  const own = by === "normals" ? { BY_NORMAL: "" } : by === "clay" ? { CLAY: "" } : undefined;
  const defines = own ?? (isPerVertex ? { PER_VERTEX: "" } : {});
  if (JSON.stringify(defines) === JSON.stringify(material.defines)) return;
  material.defines = defines;
  material.needsUpdate = true;
}

/** Which colours values have. */
export function paint(material: three.ShaderMaterial, palette: PaletteName): void {
  material.uniforms["stops"]!.value = vectorsOf(palette);
}

function vectorsOf(palette: PaletteName): three.Vector3[] {
  return palettes[palette].stops.map(([r, g, b]) => new three.Vector3(r / 255, g / 255, b / 255));
}
