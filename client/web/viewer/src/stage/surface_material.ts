import * as three from "three";
import { stops } from "../model/colours.js";

// Lit from the eye and from above, in sRGB throughout: no conversions, so that the legend's colours are the surface's.

const vertexShader = `
attribute float value;
varying float vValue;
varying vec3 vNormal;
varying vec3 vToEye;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  vValue = value;
  vNormal = normalMatrix * normal;
  vToEye = -seen.xyz;
  gl_Position = projectionMatrix * seen;
}`;

const fragmentShader = `
uniform float red;
uniform float low;
uniform float logarithmic;
uniform float colourful;
uniform float byNormal;
uniform vec3 plain;
uniform vec3 stops[5];
varying float vValue;
varying vec3 vNormal;
varying vec3 vToEye;

vec3 blueToRed(float t) {
  float scaled = clamp(t, 0.0, 1.0) * 4.0;
  if (scaled < 1.0) return mix(stops[0], stops[1], scaled);
  if (scaled < 2.0) return mix(stops[1], stops[2], scaled - 1.0);
  if (scaled < 3.0) return mix(stops[2], stops[3], scaled - 2.0);
  return mix(stops[3], stops[4], scaled - 3.0);
}

void main() {
  vec3 normal = normalize(vNormal);
  if (!gl_FrontFacing) normal = -normal;
  float value = logarithmic > 0.5 ? log(vValue / low) / log(red / low) : (vValue - low) / max(red - low, 1e-30);
  vec3 colour = mix(plain, blueToRed(red > low ? value : 0.0), colourful);
  colour = mix(colour, 0.5 + 0.5 * normal, byNormal);
  vec3 toEye = normalize(vToEye);
  vec3 key = normalize(vec3(0.35, 0.75, 0.6));
  float diffuse = 0.52 + 0.36 * max(dot(normal, key), 0.0) + 0.2 * max(dot(normal, toEye), 0.0);
  float shine = pow(max(dot(normal, normalize(key + toEye)), 0.0), 40.0) * 0.16;
  float rim = pow(1.0 - max(dot(normal, toEye), 0.0), 3.0) * 0.1;
  gl_FragColor = vec4(colour * (gl_FrontFacing ? diffuse : 0.55 * diffuse) + shine + rim * colour, 1.0);
}`;

export function surfaceMaterial(): three.ShaderMaterial {
  return new three.ShaderMaterial({
    vertexShader,
    fragmentShader,
    side: three.DoubleSide,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: {
      red: { value: 1 },
      low: { value: 0 },
      logarithmic: { value: 0 },
      colourful: { value: 1 },
      byNormal: { value: 0 },
      plain: { value: new three.Vector3(0.72, 0.75, 0.8) },
      stops: { value: stops.map(([r, g, b]) => new three.Vector3(r / 255, g / 255, b / 255)) },
    },
  });
}
