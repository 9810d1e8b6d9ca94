// Drawn on a grid of 24 by 24.
const paths = {
  move: '<path d="M5 3l14 7.5-6.2 1.6L9.6 18z"/>',
  brush: '<path d="M14.5 4.5l5 5-8 8H6.500v-5z" /><path d="M3.500 20.500h9"/>',
  lasso:
    '<path d="M12 4.500c4.700 0 8.500 2.400 8.500 5.500s-3.800 5.500-8.500 5.500S3.500 13.100 3.500 10 7.300 4.500 12 4.500z" stroke-dasharray="3 2.200"/><path d="M8 15c-1.500 1.500-1 3.500-3 5"/>',
  box: '<rect x="4" y="5" width="16" height="14" rx="1" stroke-dasharray="3.200 2.300"/>',
  paint:
    '<path d="M12 3.500c3.300 4.200 5.500 7 5.500 10a5.500 5.500 0 0 1-11 0c0-3 2.200-5.800 5.500-10z"/><path d="M9.500 14.500a2.700 2.700 0 0 0 2.500 2.300"/>',
  undo: '<path d="M8.500 5L4 9.500 8.500 14"/><path d="M4.500 9.500H14a5.500 5.500 0 0 1 0 11h-3"/>',
  redo: '<path d="M15.500 5L20 9.500 15.500 14"/><path d="M19.500 9.500H10a5.500 5.500 0 0 0 0 11h3"/>',
  open: '<path d="M3.500 18.500v-12h6l2 2.500h9v9.500z"/>',
  save: '<path d="M12 4v11M7.500 11L12 15.500 16.500 11M4.500 19.500h15"/>',
  split: '<rect x="3.500" y="5" width="17" height="14" rx="2"/><path d="M12 5v14"/>',
  help: '<circle cx="12" cy="12" r="8.500"/><path d="M9.500 9.700a2.600 2.600 0 1 1 3.700 2.400c-.8.400-1.200.9-1.200 1.900M12 17v.3"/>',
  sun: '<circle cx="12" cy="12" r="3.800"/><path d="M12 3v2M12 19v2M3 12h2M19 12h2M5.600 5.600L7 7M17 17l1.400 1.400M18.400 5.600L17 7M7 17l-1.400 1.400"/>',
  moon: '<path d="M19.500 14.500A8 8 0 0 1 9.500 4.500a8 8 0 1 0 10 10z"/>',
  panel: '<rect x="3.500" y="5" width="17" height="14" rx="2"/><path d="M15 5v14"/>',
  fit: '<path d="M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"/>',
  lock: '<rect x="6" y="11" width="12" height="8.500" rx="1.500"/><path d="M8.500 11V8a3.500 3.500 0 0 1 7 0v3"/>',
  unlock: '<rect x="6" y="11" width="12" height="8.500" rx="1.500"/><path d="M8.500 11V8a3.500 3.500 0 0 1 6.800-1.200"/>',
  trash: '<path d="M5 7h14M9.500 7V4.500h5V7M7 7l.8 12.500h8.400L17 7M10.300 10.500v5.500M13.700 10.500v5.500"/>',
  translate:
    '<path d="M12 3v18M3 12h18M12 3L9.500 5.500M12 3l2.500 2.500M12 21l-2.500-2.500M12 21l2.500-2.500M3 12l2.500-2.500M3 12l2.500 2.500M21 12l-2.500-2.500M21 12l-2.500 2.500"/>',
  rotate: '<path d="M19.500 12a7.500 7.500 0 1 1-2.500-5.600"/><path d="M17.500 2.500v4.300h-4.300"/>',
  together:
    '<path d="M10 14a4 4 0 0 0 5.700 0l3-3a4 4 0 0 0-5.700-5.700l-1 1M14 10a4 4 0 0 0-5.700 0l-3 3a4 4 0 0 0 5.700 5.700l1-1"/>',
  reset: '<path d="M4.500 12a7.500 7.500 0 1 0 2.500-5.600"/><path d="M6.500 2.500v4.300h4.300"/>',
  warning: '<path d="M12 4.500l8.500 15h-17z"/><path d="M12 10v4.500M12 17v.3"/>',
  shape:
    '<path d="M12 3.500l7.500 4.200v8.600L12 20.500l-7.500-4.200V7.700z"/><path d="M4.700 7.800L12 12l7.300-4.200M12 12v8.300"/>',
  pin: '<path d="M9 4h6l-.8 6 3.300 3.500h-11L9.800 10zM12 13.500V20"/>',
} as const;

export type IconName = keyof typeof paths;

export function icon(name: IconName): SVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  svg.classList.add("icon");
  svg.innerHTML = paths[name];
  return svg;
}
