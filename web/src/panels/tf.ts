// The tree of frames, with the age of each transform.
import type { App, Panel } from '../app/app';
import { fill, h, say } from '../app/dom';
import { Seen } from '../app/seen';

interface Row {
  frame: string;
  out: HTMLElement;
  rate: HTMLElement;
  pose: HTMLElement;
}

export function tfPanel(app: App): Panel {
  const { twin } = app;
  const list = h('div', { class: 'tf' });
  const head = h('div', { class: 'tf-row tf-head muted', style: '--depth:0' }, h('span', {}, 'frame'), h('span', { class: 'tf-pose' }, 'x  y  z, mm'), h('span', { class: 'tf-rate' }, 'rate'), h('span', { class: 'age' }, 'age'));
  const seen = new Seen<Row>(show);
  let known = -1;

  function build(): void {
    const children = new Map<string, string[]>();
    for (const [child, transform] of twin.transforms.frames) {
      const list_ = children.get(transform.parent) ?? [];
      list_.push(child);
      children.set(transform.parent, list_);
    }
    const rows: [HTMLElement, Row][] = [];
    const walk = (frame: string, depth: number): void => {
      if (depth > 200) return;
      const out = h('span', { class: 'num muted age' });
      const rate = h('span', { class: 'num muted tf-rate' });
      const pose = h('span', { class: 'num muted tf-pose', title: 'x y z in millimetres, in the frame above' });
      const link = twin.tree?.linkIndex.get(frame);
      rows.push([h('div', { class: 'tf-row', style: `--depth:${Math.min(depth, 14)}` },
        link === undefined ? h('span', {}, frame) : h('button', { type: 'button', class: 'plain', title: `Select ${frame}`, onclick: () => app.select({ link }) }, frame), pose, rate, out), { frame, out, rate, pose }]);
      for (const child of children.get(frame) ?? []) walk(child, depth + 1);
    };
    for (const parent of children.keys()) if (!twin.transforms.frames.has(parent)) walk(parent, 0);
    fill(list, rows.length > 0 ? [head, ...rows.map(([element]) => element)] : h('p', { class: 'empty' }, 'No transforms yet: nothing is published on /tf and /tf_static.'));
    seen.watch(rows);
  }

  function show({ frame, out, rate, pose }: Row): void {
    const transform = twin.transforms.frames.get(frame);
    if (!transform) return;
    const age = (performance.now() - transform.at) / 1000;
    say(out, transform.still ? '' : age < 1 ? `${(age * 1000).toFixed(0)} ms` : `${age.toFixed(0)} s`);
    say(rate, transform.still ? 'static' : `${transform.rate.toFixed(0)} Hz`);
    out.classList.toggle('warning', !transform.still && age > 1 && !twin.paused);
    say(pose, [0, 1, 2].map((i) => (transform.pose[i]! * 1000).toFixed(1)).join('  '));
  }

  return {
    id: 'tf', title: 'TF', rate: 4, element: list,
    update: () => {
      const { edges } = twin.transforms;
      if (edges !== known) {
        known = edges;
        build();
      }
      for (const row of seen) show(row);
    },
  };
}
