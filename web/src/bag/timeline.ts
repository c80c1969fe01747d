// The line below the picture and the panels: the time of a recording, with marks for what was logged.
import { copyText } from '../app/clipboard';
import { button, h, say } from '../app/dom';
import { isTyping } from '../app/escape';
import { setIcon, icon } from '../app/icons';
import type { BagEvent } from './bag';
import { SPEEDS, type Playback } from './playback';
import type { Survey } from './survey';

// Focused by the keyboard, space presses them; a mouse leaves the focus on what it has pressed.
const PRESSED = 'button:focus-visible, summary:focus-visible, a:focus-visible, input';
const MOVED = 'canvas, input, [role="tab"], [role="separator"]'; // by arrow keys
const FRAME = 1 / 30; // s
const LARGE_STEP = 1; // s
const BUCKETS = 300; // places for marks
const READING_TIME = 250; // ms of reading before it is shown

const WARNING = 30,
  ERROR = 40; // levels of a log line

export function timeText(seconds: number, length: number): string {
  const ms = Math.round(seconds * 1000);
  const rest = ((ms % 60_000) / 1000).toFixed(3);
  if (length < 60) return rest;
  const minutes = Math.floor(ms / 60_000);
  const two = (value: number): string => String(value).padStart(2, '0');
  return `${length < 3600 ? two(minutes) : `${Math.floor(minutes / 60)}:${two(minutes % 60)}`}:${rest.padStart(
    6,
    '0',
  )}`;
}

interface Actions {
  link: () => string; // the address of this moment; '' if a file was dropped
  compare: () => void;
  open: () => void;
  readAll: () => void; // of a large recording on a server
  back: (() => void) | null; // to the twin that was shown before; null: there was none
}

function iconButton(name: string, title: string, id: string, press: () => void): HTMLButtonElement {
  return button(icon(name), title, press, { class: 'icon', id });
}

function makeSpeed(playback: Playback): HTMLSelectElement {
  const options = SPEEDS.map((factor) => h('option', { value: String(factor), selected: factor === 1 }, `${factor}×`));
  const about = { 'aria-label': 'Speed of the recording', title: 'Speed of the recording', id: 'bag-speed' };
  const select = h('select', { ...about, onchange: () => playback.setSpeed(Number(select.value)) }, options);
  return select;
}

export class Timeline {
  readonly element: HTMLElement;
  private readonly track: HTMLElement;
  private readonly now = h('i', { class: 'bag-now' });
  private readonly read = h('i', { class: 'bag-read' });
  private readonly marks = h('div', { class: 'bag-marks' });
  private readonly play: HTMLButtonElement;
  private readonly time = h('output', { class: 'num bag-time' });
  private readonly speed: HTMLSelectElement;
  private readonly loop: HTMLButtonElement;
  readonly all: HTMLButtonElement;
  private readingSince = 0;
  private ends: (() => void)[] = [];

  constructor(
    private readonly playback: Playback,
    private readonly survey: Survey,
    private readonly events: BagEvent[],
    actions: Actions,
  ) {
    const about = { 'aria-label': 'Time of the recording', title: 'Drag to move through the recording' };
    const parts = [this.read, this.marks, this.now];
    this.track = h('div', { class: 'bag-track', role: 'slider', tabIndex: 0, ...about }, parts);
    this.play = iconButton('play', 'Play (space)', 'bag-play', () => playback.play(!playback.isPlaying));
    const loop = (): void => playback.setLoop(!playback.loops);
    this.loop = iconButton('loop', 'Loop: begin again at the end (L)', 'bag-loop', loop);
    this.speed = makeSpeed(playback);
    const copy = (): void => void copyText(actions.link(), 'The link to this moment');
    const link = button('Copy link', 'Copy a link to this moment', copy, { id: 'bag-link' });
    if (actions.link() === '') {
      link.disabled = true;
      link.title = 'A file of this machine has no address: put it on a server and open ?bag=ADDRESS';
    }
    const whole = 'Read the whole recording, for its curves and marks';
    this.all = button('Read all', whole, actions.readAll, { id: 'bag-all', hidden: true });
    const second = 'Open a second recording, to compare it with this one';
    const back = 'Close the recording, and connect to the twin again';
    const more = [
      button('Compare…', second, actions.compare, { id: 'bag-compare' }),
      actions.back && button('Back to the twin', back, actions.back, { id: 'bag-back-to-twin' }),
      button('Open…', 'Open another recording', actions.open, { id: 'bag-open' }),
    ];
    const steps = [
      iconButton('reset', 'The message before (,)', 'bag-back', () => void playback.step(-1)),
      this.play,
      iconButton('step', 'The next message (.)', 'bag-next', () => void playback.step(1)),
    ];
    this.element = h(
      'section',
      { class: 'bag-line', 'aria-label': 'Time line of the recording' },
      h('div', { class: 'bag-group' }, steps),
      this.time,
      this.track,
      h('div', { class: 'bag-group bag-more' }, this.all, this.speed, this.loop, link, more),
    );
    this.listen();
  }

  private listen(): void {
    const onKey = (event: KeyboardEvent): void => this.press(event);
    this.track.addEventListener('pointerdown', (event) => this.drag(event));
    addEventListener('keydown', onKey);
    this.ends = [
      this.playback.moved.on(() => this.show()),
      this.playback.changed.on(() => this.showState()),
      this.survey.changed.on(() => this.showMarks()),
      () => removeEventListener('keydown', onKey),
    ];
    this.show();
    this.showState();
    this.showMarks();
  }

  end(): void {
    for (const end of this.ends) end();
    this.element.remove();
  }

  private drag(down: PointerEvent): void {
    if (down.button !== 0) return;
    const marked = (down.target as HTMLElement).dataset['time'];
    const seek = (event: PointerEvent): void => {
      const box = this.track.getBoundingClientRect();
      this.playback.seek(((event.clientX - box.left) / box.width) * this.playback.length);
    };
    this.track.setPointerCapture(down.pointerId);
    this.track.addEventListener('pointermove', seek);
    this.track.addEventListener('lostpointercapture', () => this.track.removeEventListener('pointermove', seek), {
      once: true,
    });
    if (marked !== undefined) this.playback.seek(Number(marked));
    else seek(down);
  }

  private press(event: KeyboardEvent): void {
    const { playback } = this;
    const { target } = event;
    const isOwn = target instanceof Node && this.element.contains(target);
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping(target) || document.querySelector('dialog[open]')) return;
    const focused = target instanceof HTMLElement && target !== this.play && target !== document.body ? target : null;
    if (event.code === 'Space' && focused?.matches(PRESSED)) return;
    if (event.code.startsWith('Arrow') && !isOwn && focused?.matches(MOVED)) return;
    const step = event.shiftKey ? LARGE_STEP : FRAME;
    switch (event.code) {
      case 'Space':
        if (!event.repeat) playback.play(!playback.isPlaying);
        break;
      case 'ArrowLeft':
        playback.seek(playback.time - step);
        break;
      case 'ArrowRight':
        playback.seek(playback.time + step);
        break;
      case 'Home':
        playback.seek(0);
        break;
      case 'End':
        playback.seek(playback.length);
        break;
      case 'Comma':
        void playback.step(-1);
        break;
      case 'Period':
        void playback.step(1);
        break;
      case 'KeyL':
        playback.setLoop(!playback.loops);
        break;
      default:
        return;
    }
    event.preventDefault();
  }

  private show(): void {
    const { time, length } = this.playback;
    const share = length > 0 ? time / length : 0;
    this.track.style.setProperty('--share', `${(share * 100).toFixed(3)}%`);
    say(this.time, `${timeText(time, length)} / ${timeText(length, length)}`);
    this.track.setAttribute('aria-valuemin', '0');
    this.track.setAttribute('aria-valuemax', length.toFixed(3));
    this.track.setAttribute('aria-valuenow', time.toFixed(3));
    this.track.setAttribute('aria-valuetext', `${time.toFixed(2)} of ${length.toFixed(2)} seconds`);
  }

  private showState(): void {
    const { isPlaying, loops, speed } = this.playback;
    setIcon(this.play, isPlaying ? 'pause' : 'play');
    this.play.title = isPlaying ? 'Pause (space)' : 'Play (space)';
    this.play.setAttribute('aria-label', this.play.title);
    this.loop.setAttribute('aria-pressed', String(loops));
    this.speed.value = String(speed);
  }

  // Several times a second.
  update(): void {
    const now = performance.now();
    if (!this.playback.isReading) this.readingSince = 0;
    else if (this.readingSince === 0) this.readingSince = now;
    this.element.classList.toggle('reading', this.readingSince > 0 && now - this.readingSince > READING_TIME);
  }

  private showMarks(): void {
    const { length } = this.playback;
    this.read.style.width = `${
      length > 0 ? Math.min(100, (this.survey.isComplete ? 1 : this.survey.done / length) * 100) : 100
    }%`;
    const places = new Map<string, { time: number; kind: string; texts: string[] }>();
    const put = (time: number, kind: string, text: string): void => {
      const key = `${kind} ${length > 0 ? Math.round((time / length) * BUCKETS) : 0}`;
      const place = places.get(key) ?? { time, kind, texts: [] };
      if (place.texts.length < 5) place.texts.push(`${time.toFixed(2)} s  ${text}`);
      places.set(key, place);
    };
    for (const { time, line } of this.survey.lines)
      if (line.level >= WARNING) put(time, line.level >= ERROR ? 'error' : 'warning', `${line.name}: ${line.text}`);
    for (const { time, text } of this.events) put(time, 'event', text);
    const known = `${[...places.keys()].join()}`;
    if (this.marks.dataset['known'] === known) return;
    this.marks.dataset['known'] = known;
    this.marks.replaceChildren(
      ...[...places.values()].map(({ time, kind, texts }) =>
        h('b', {
          class: `bag-mark ${kind}`,
          title: texts.join('\n'),
          'data-time': String(time),
          style: `left:${length > 0 ? (time / length) * 100 : 0}%`,
        }),
      ),
    );
  }
}
