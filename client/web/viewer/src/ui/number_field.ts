import { el } from "./dom.js";

export interface NumberFieldOptions {
  /** Its name for screen readers. */
  label: string;
  title: string;
  /** The least and the largest value. */
  range?: readonly [number, number];
  /** By how much an arrow key changes the value; ten times that with Shift. */
  step: () => number;
  /** The user has entered a number. */
  entered: (value: number) => void;
  /** An arrow key, which may repeat, has changed the value. */
  stepped: (value: number, event: KeyboardEvent) => void;
  /** What was entered is no number of the range. */
  refused: (why: string) => void;
}

export interface NumberField {
  element: HTMLInputElement;
  /** `text`: instead of the number. While the user types, the field stays as it is. */
  show: (value: number, text?: string) => void;
}

/** A number that is typed: Enter or leaving the field takes it, Escape drops it, arrow keys change it by steps. */
export function numberField({ label, title, range, step, entered, stepped, refused }: NumberFieldOptions): NumberField {
  const [least, most] = range ?? [-Infinity, Infinity];
  const input = el("input", {
    type: "text",
    inputMode: "decimal",
    className: "number",
    autocomplete: "off",
    title,
    aria: { label },
  });
  let [value, shown, isTyping] = [0, "", false];
  const reset = () => {
    isTyping = false;
    input.value = shown;
  };
  input.addEventListener("input", () => (isTyping = true));
  input.addEventListener("focus", () => input.select());
  input.addEventListener("change", () => {
    const typed = numberIn(input.value);
    const isSame = input.value.trim() === shown;
    reset();
    if (isSame) return;
    if (typed >= least && typed <= most) entered(typed);
    else refused(`${label} is ${range ? `a number from ${least} to ${most}` : "a number"}.`);
  });
  input.addEventListener("keydown", (event) => {
    const direction = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (event.key === "Escape" && isTyping) reset();
    else if (direction && !isTyping && !event.ctrlKey && !event.altKey) {
      const next = value + direction * step() * (event.shiftKey ? 10 : 1);
      stepped(Math.min(Math.max(next, least), most), event);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  });
  const show = (now: number, text = textOf(now)) => {
    value = now;
    shown = text;
    if (!isTyping && input.value !== text) input.value = text;
  };
  return { element: input, show };
}

/** NaN if it is none. The comma of many countries is taken, too. */
function numberIn(text: string): number {
  const plain = text.trim().replace(",", ".").replace("−", "-");
  return plain === "" || !Number.isFinite(Number(plain)) ? NaN : Number(plain);
}

/** Five digits, without an exponent where that is short. */
function textOf(value: number): string {
  return String(Number(value.toPrecision(5)) || 0);
}
