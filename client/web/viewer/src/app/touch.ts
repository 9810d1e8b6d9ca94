/** Whether the page is worked by fingers. */
export const touches = () => matchMedia("(pointer: coarse)").matches;

/** What is done to choose a place: “tap” or “click”. */
export const pressing = () => (touches() ? "tap" : "click");
