#pragma once

namespace lpdeform::reproduce {

/// The page's style sheet: light or dark by the reader's setting, for narrow screens, and for print.
inline constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --ink: #1d2329; --soft: #5b6670; --paper: #ffffff; --card: #f6f7f9; --line: #d9dee3;
  --good: #14703a; --good-back: #e2f4e8; --bad: #a3281f; --bad-back: #fbe6e3;
  --series-0: #1f5fd0; --series-1: #c8501e; --series-2: #25855a; --series-3: #7a3fb0; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ec; --soft: #a3adb6; --paper: #14181c; --card: #1d2329; --line: #3a434b;
    --good: #7fdca2; --good-back: #17382a; --bad: #ff9d92; --bad-back: #452220;
    --series-0: #7fb0ff; --series-1: #ff9d66; --series-2: #6fd6a0; --series-3: #c9a0ff; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1180px; padding: 2rem 1.25rem 4rem; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", "DejaVu Sans", sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.3rem; margin: 0 0 .25rem; }
p { margin: .4rem 0; }
a { color: var(--series-0); }
section { border-top: 1px solid var(--line); margin-top: 2.25rem; padding-top: 1.5rem; }
.shape, .note, footer { color: var(--soft); }
.note, footer { font-size: .9rem; max-width: 60rem; }
.claim { background: var(--card); border-left: 4px solid var(--good); border-radius: 4px; margin: .8rem 0;
  padding: .6rem .9rem; }
.claim.fails { border-left-color: var(--bad); }
.claim p { margin: .15rem 0; }
.claim b { font-weight: 600; }
.verdict { border-radius: 3px; font-size: .85rem; font-weight: 600; padding: .1rem .5rem; white-space: nowrap;
  background: var(--good-back); color: var(--good); }
.fails .verdict, .verdict.fails { background: var(--bad-back); color: var(--bad); }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: .3rem .65rem; text-align: right; white-space: nowrap; }
th:first-child { text-align: left; }
thead th { border-bottom: 2px solid var(--line); color: var(--soft); font-weight: 600; }
tbody th { font-weight: 500; }
.plots, .pictures { display: grid; gap: 1rem; margin: 1rem 0 .5rem; }
.plots { grid-template-columns: repeat(auto-fit, minmax(300px, 1fr)); }
.pictures { grid-template-columns: repeat(3, 1fr); }
.pictures.tall { max-width: 780px; }
.pictures.tall.of_5 { grid-template-columns: repeat(5, 1fr); max-width: none; }
.pictures.of_2 { grid-template-columns: repeat(2, 1fr); max-width: 750px; }
.pictures.tall.of_2 { max-width: 514px; }
@media (max-width: 760px) { .pictures, .pictures.tall, .pictures.tall.of_5 { grid-template-columns: repeat(2, 1fr); } }
.legend { color: var(--soft); font-size: .85rem; }
.legend .bar { border-radius: 2px; display: inline-block; height: .6em; margin: 0 .3em; width: 8em; }
figure { margin: 0; }
figure img { border-radius: 6px; display: block; height: auto; width: 100%; }
figcaption { color: var(--soft); font-size: .9rem; padding-top: .3rem; text-align: center; }
svg { display: block; height: auto; max-width: 520px; width: 100%; }
svg text { fill: var(--ink); font: 11px system-ui, "DejaVu Sans", sans-serif; }
svg .title { font-size: 13px; font-weight: 600; }
svg .label { fill: var(--soft); font-size: 12px; }
svg .axis { stroke: var(--soft); }
svg .grid { stroke: var(--line); }
svg .bar { fill: var(--series-0); }
svg .line { fill: none; stroke-width: 2; }
svg .line_0 { stroke: var(--series-0); }
svg .line_1 { stroke: var(--series-1); stroke-dasharray: 7 3; }
svg .line_2 { stroke: var(--series-2); stroke-dasharray: 2 3; }
svg .line_3 { stroke: var(--series-3); stroke-dasharray: 8 3 2 3; }
@media print { section { break-inside: avoid; } }
)";

}  // namespace lpdeform::reproduce
