import { type Box, overlap } from "../model/free_room.js";

const controls = ".rail, .options, .legend, .dock, .split ~ .dock > *";
/**
 * What the page says of the work that has just been opened. Where room is little, the notice stands beside the pictures (small.css), and
 * the others lie over the shape until the next press.
 */
const said = ", .notice, .aside, .restored, .banner";
/** Where small.css puts the controls beside the pictures. */
const littleRoom = matchMedia(
  "(max-width: 720px), (min-aspect-ratio: 1/1) and (max-height: 560px), " +
    "(max-width: 900px) and (max-height: 900px), (max-width: 1150px) and (max-height: 600px)",
);
const margin = 8;
/** The arrow of a handle at the top of the surface. */
const arrow = 44;

/** What the page's controls cover of a picture, in pixels from its corner. */
export function coversOf(picture: HTMLElement): Box[] {
  const { left, top, right, bottom, width } = picture.getBoundingClientRect();
  // The connection, and the hint where it is over the picture, also before there is one.
  const messages = littleRoom.matches ? 48 : arrow + (width > 620 ? 98 : 110);
  const shown = littleRoom.matches ? controls : controls + said;
  const boxes = [...document.querySelectorAll(shown)].map((control) => control.getBoundingClientRect());
  return [
    { left: 0, top: 0, right: right - left, bottom: messages },
    { left: 0, top: bottom - top - margin, right: right - left, bottom: bottom - top },
    ...boxes
      .filter((box) => box.width > 0 && box.left < right && box.right > left && box.top < bottom && box.bottom > top)
      .map((box) => ({
        left: box.left - left - margin,
        top: box.top - top - margin,
        right: box.right - left + margin,
        bottom: box.bottom - top + margin,
      })),
  ];
}

/** Whether the options of the tool lie over this part of a picture. */
export function areOptionsOver(picture: HTMLElement, part: Box): boolean {
  const { left, top } = picture.getBoundingClientRect();
  return [...document.querySelectorAll(".options")]
    .map((options) => options.getBoundingClientRect())
    .some((box) =>
      overlap(part, { left: box.left - left, top: box.top - top, right: box.right - left, bottom: box.bottom - top }),
    );
}
