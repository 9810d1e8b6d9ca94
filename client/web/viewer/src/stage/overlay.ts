/** The line of a lasso or box over a stage. */
export class Overlay {
  readonly element = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  readonly #line = document.createElementNS("http://www.w3.org/2000/svg", "polygon");

  constructor() {
    this.element.classList.add("overlay");
    this.element.append(this.#line);
  }

  /** x and y in turn; an empty polygon hides the line. */
  show(polygon: readonly number[]): void {
    const points: string[] = [];
    for (let k = 0; k + 1 < polygon.length; k += 2) points.push(`${polygon[k]},${polygon[k + 1]}`);
    this.#line.setAttribute("points", points.join(" "));
  }
}
