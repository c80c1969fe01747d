#include "doppel/validation/reports/detail/html_pieces.h"

namespace doppel {

namespace {

constexpr std::string_view kStyle = R"css(
:root { --ink: #16191d; --quiet: #59636e; --paper: #fff; --ground: #f4f6f8; --line: #d8dee4; --good: #1a7f37;
  --bad: #b3261e; --care: #8a5a00; --link: #0b6bcb; --code: #eef1f4; color-scheme: light; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ed; --quiet: #9aa5b1; --paper: #171b20; --ground: #0e1114; --line: #333b44;
    --good: #4cc267;
    --bad: #ff7b72; --care: #e3b341; --link: #6cb6ff; --code: #232930; color-scheme: dark; }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; scroll-behavior: smooth; }
body { margin: 0; font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif;
  color: var(--ink); background: var(--ground); overflow-wrap: anywhere; }
main { max-width: 980px; margin: 0 auto; padding: 20px 16px 56px; }
h1 { font-size: 26px; line-height: 1.25; margin: 0; }
h2 { font-size: 19px; margin: 36px 0 10px; }
h3 { font-size: 16px; margin: 0; }
p { margin: 6px 0; }
a { color: var(--link); }
.quiet { color: var(--quiet); }
.card { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 16px;
  margin: 12px 0; }
.verdict { border-left: 8px solid var(--good); }
.verdict.bad { border-left: 8px double var(--bad); }
.verdict .headline { font-size: 17px; font-weight: 600; margin: 8px 0 0; }
.counts { display: flex; flex-wrap: wrap; gap: 6px 14px; margin: 10px 0 0; padding: 0; list-style: none; }
.badge { display: inline-block; white-space: nowrap; font-size: 13px; font-weight: 600; line-height: 20px;
  padding: 0 8px;
  border: 1.5px solid currentColor; border-radius: 11px; color: var(--quiet); }
.badge.passed { color: var(--good); }
.badge.failed, .badge.not_run { color: #fff; background: #b3261e; border-color: #b3261e; }
.badge.warning, .badge.not_judged, .badge.waived { color: var(--care); border-style: dashed; }
.check { background: var(--paper); border: 1px solid var(--line); border-top-width: 0; }
.check:first-of-type { border-top-width: 1px; border-radius: 10px 10px 0 0; }
.check:last-of-type { border-radius: 0 0 10px 10px; }
.check:only-of-type { border-radius: 10px; }
.check > summary { display: grid; grid-template-columns: 128px 44px minmax(150px, 3fr) 5fr; gap: 2px 10px;
  padding: 9px 14px;
  cursor: pointer; align-items: baseline; list-style: none; }
.check > summary::-webkit-details-marker { display: none; }
.check > summary .badge { justify-self: start; }
.check > summary .title { font-weight: 600; }
.check > summary .id { color: var(--quiet); font-variant-numeric: tabular-nums; }
.check > summary .title::after { content: " \25b8"; color: var(--quiet); font-weight: 400; }
.check[open] > summary .title::after { content: " \25be"; }
.check > .inside { padding: 2px 14px 14px; border-top: 1px dashed var(--line); }
.failure > header { display: flex; flex-wrap: wrap; gap: 4px 10px; align-items: baseline; }
.failure { border-left: 5px solid var(--bad); }
.failure.careful { border-left: 5px dashed var(--care); }
.item { padding: 10px 0 2px; }
.item + .item { border-top: 1px solid var(--line); margin-top: 10px; }
.item p { margin: 2px 0; }
.fix::before { content: "Fix: "; font-weight: 700; }
.fix { border-left: 3px solid var(--good); padding-left: 9px; margin: 5px 0 !important; }
code, pre { font: 13px/1.45 ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; }
.place { color: var(--quiet); }
.command { display: flex; gap: 8px; align-items: flex-start; margin: 6px 0; }
.command code { flex: 1; min-width: 0; background: var(--code); border-radius: 6px; padding: 5px 8px; }
button { font: inherit; font-size: 13px; color: var(--ink); background: var(--paper);
  border: 1px solid var(--line);
  border-radius: 6px; padding: 3px 10px; cursor: pointer; }
button:hover { border-color: var(--quiet); }
:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
figure { margin: 12px 0; }
figcaption { color: var(--quiet); font-size: 14px; }
.plot, .table { overflow-x: auto; -webkit-overflow-scrolling: touch; }
.plot svg { display: block; width: 100%; min-width: 540px; height: auto; border-radius: 8px;
  border: 1px solid var(--line); }
.arm { position: relative; background: #fff; border: 1px solid var(--line); border-radius: 8px;
  overflow: hidden;
  max-width: 640px; aspect-ratio: 4 / 3; }
.arm svg, .arm canvas { display: block; width: 100%; height: 100%; }
.arm canvas { display: none; cursor: grab; touch-action: pan-y; }
.arm canvas:active { cursor: grabbing; }
.arm.live canvas { display: block; }
.arm.live svg { display: none; }
.arm .hint { display: none; position: absolute; right: 8px; bottom: 6px; font-size: 12px; color: #59636e;
  pointer-events: none; }
.arm.live .hint { display: block; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
th, td { text-align: left; padding: 4px 10px 4px 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { color: var(--quiet); font-weight: 600; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.over { font-weight: 700; }
td.over::after { content: " !"; color: var(--bad); }
td.hash { font: 12px/1.4 ui-monospace, "DejaVu Sans Mono", monospace; word-break: break-all; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 4px 16px; margin: 0; }
dt { color: var(--quiet); }
dd { margin: 0; min-width: 0; }
@media (max-width: 680px) {
  main { padding: 12px 10px 40px; }
  .card { padding: 12px; }
  .check > summary { grid-template-columns: auto 36px 1fr; padding: 9px 10px; }
  .check > summary .result { grid-column: 1 / -1; }
  dl { grid-template-columns: 1fr; gap: 0; }
  dd { margin-bottom: 8px; }
  .command { flex-direction: column; }
  .command code { width: 100%; }
}
@page { size: A4; margin: 14mm 12mm; }
@media print {
  :root { --ground: #fff; --line: #b9c1c9; }
  body { font-size: 10pt; }
  main { max-width: none; padding: 0; }
  button, .hint, .arm canvas { display: none !important; }
  .arm.live svg { display: block !important; }
  .arm { max-width: 115mm; }
  .card, .check { break-inside: auto; }
  h2, header { break-after: avoid; }
  figure, tr, .check > summary { break-inside: avoid; }
  .plot { overflow: visible; }
  .plot svg { min-width: 0; }
  .badge { color: #000 !important; background: none !important; border-color: #000 !important; }
  .badge.failed, .badge.not_run { border-width: 2.5px !important; }
  .check > summary .title::after { content: none !important; }
  a { color: inherit; }
}
)css";

}  // namespace

std::string_view report_style() {
  return kStyle;
}

}  // namespace doppel
