const context = document.createElement("canvas").getContext("webgl2");

/** Without WebGL nothing can be drawn. */
export const canDraw = context !== null;

/** Whether the processor draws; then every pixel counts. */
export const isSoftware = context !== null && isByProcessor(context);

function isByProcessor(context: WebGL2RenderingContext): boolean {
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
