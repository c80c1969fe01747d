// A recording in the page: it takes the place of the twin, with a time line, curves of the whole of it, and a second
// recording to compare with.
import type { App } from '../app/app';
import '../app/workbench'; // it is there anyway; imported here, what the first picture loads is not split further
import { button, h, toast } from '../app/dom';
import { chooseRecording } from '../app/recordings';
import type { Bag } from './bag';
import type { Progress } from './bytes';
import { Comparison } from './compare';
import { openAddress as openBagAt, openDropped } from './folder';
import { Playback } from './playback';
import { BagSource } from './source';
import { Survey } from './survey';
import { Timeline } from './timeline';

type Addresses = { first: string; second: string }; // '' for dropped files

const LARGE = 200e6; // bytes that are not read from a server as a whole without a click
const PICTURE_TIME = 5000; // ms after which a repeated problem is reported again

class Session {
  readonly playback: Playback;
  survey: Survey | null = null; // with the panels
  timeline: Timeline | null = null;
  comparison: Comparison | null = null;
  private readonly ends: (() => void)[] = [];

  constructor(
    private readonly app: App,
    readonly bag: Bag,
    readonly addresses: Addresses,
    time: number,
    private readonly hasTwin: boolean,
  ) {
    const { twin } = app;
    const source = new BagSource(bag);
    this.playback = new Playback(source);
    source.onjump = (to, setsLog) => twin.rewind(setsLog && this.survey ? this.survey.logUntil(to) : []);
    source.ownsLog = (to) => this.survey?.covers(to) ?? false;
    bag.onproblem = reporter();
    twin.opening = '';
    twin.read(source);
    source.start();
    this.playback.seek(time);
  }

  // With the panels: curves, log and the time line.
  complete(): void {
    const { app, bag, playback } = this;
    const survey = new Survey(bag, app.recorder, () => playback.isPlaying || playback.isReading);
    this.survey = survey;
    app.playback = playback;
    app.playbackChanged.emit();
    const timeline = new Timeline(playback, survey, bag.events, {
      link: () => this.link(),
      compare: () => chooseRecording(app, 'second'),
      open: () => chooseRecording(app),
      readAll: () => this.readAll(),
      back: this.hasTwin ? () => location.reload() : null,
    });
    this.timeline = timeline;
    document.getElementById('app')!.append(timeline.element);
    this.ends.push(
      app.world.stage.tick.on((dt) => {
        timeline.update(); // before the next part is read
        playback.tick(dt);
      }),
      app.twin.selectedRobot.on((space) => {
        survey.twin.selectRobot(space);
        survey.restart();
      }),
    );
    if (bag.isRemote && bag.byteCount > LARGE) timeline.all.hidden = false;
    else survey.begin();
  }

  private readAll(): void {
    if (this.timeline) this.timeline.all.hidden = true;
    this.survey?.begin();
  }

  // The address of the present moment; '' for a dropped file.
  private link(): string {
    const { first, second } = this.addresses;
    if (first === '') return '';
    const url = new URL(location.href);
    url.searchParams.set('bag', first);
    if (this.comparison && second) url.searchParams.set('bag2', second);
    else url.searchParams.delete('bag2');
    url.searchParams.set('t', this.playback.time.toFixed(3));
    return url.href.replaceAll('%2F', '/').replaceAll('%3A', ':');
  }

  compare(bag: Bag, address: string): void {
    if (!this.survey) return;
    this.comparison?.end();
    bag.onproblem = this.bag.onproblem;
    this.addresses.second = address;
    this.comparison = new Comparison(this.app, this.playback, this.survey, bag);
    this.app.openPanel('compare'); // beside the curves
  }

  end(): void {
    this.playback.play(false);
    this.comparison?.end();
    this.survey?.stop();
    this.timeline?.end();
    for (const end of this.ends) end();
  }
}

// The same problem of a piece comes with every jump to it.
function reporter(): (text: string) => void {
  const reported = new Map<string, number>();
  return (text) => {
    const now = performance.now();
    if (now - (reported.get(text) ?? -Infinity) < PICTURE_TIME) return;
    reported.set(text, now);
    toast(text, 'error');
  };
}

let session: Session | null = null;
let hasTwin = false; // the page was connected before the first recording

// The note over the picture about what cannot be read, or is read in another way than expected.
function note(app: App, title: string, texts: string[], level: 'error' | 'warning'): void {
  const close = (): void => element.remove();
  const element = h(
    'div',
    { class: `bag-note ${level}`, role: level === 'error' ? 'alert' : 'status', id: 'bag-note' },
    h('strong', {}, title),
    texts.map((text) => h('p', {}, text)),
    h(
      'div',
      { class: 'row' },
      button('Open a recording…', 'Choose .mcap files of this machine', () => chooseRecording(app)),
      button('Close', 'Close this note', close),
    ),
  );
  document.getElementById('bag-note')?.remove();
  app.world.stage.host.append(element);
}

async function open(
  app: App,
  place: 'first' | 'second',
  read: (progress: Progress) => Promise<Bag>,
  address: string,
  time = 0,
): Promise<void> {
  const progress: Progress = (text) => (app.twin.opening = text);
  document.getElementById('bag-note')?.remove();
  try {
    const bag = await read(progress);
    if (place === 'second' && session) {
      session.compare(bag, address);
    } else {
      hasTwin ||= app.twin.client.phase === 'open' && !app.twin.recording;
      session?.end();
      session = new Session(app, bag, { first: address, second: '' }, time, hasTwin);
      Object.assign(app, { session });
      await app.workbench;
      session.complete();
    }
    app.twin.opening = '';
    const lacking = bag.topics.some(({ name }) => name.endsWith('/robot_description'))
      ? []
      : [`${bag.name} has no /robot_description, so there is no robot to draw. Curves, log, topics and pictures work.`];
    const texts = [...bag.warnings, ...lacking];
    if (texts.length > 0) note(app, 'Notes on this recording', texts, 'warning');
  } catch (problem) {
    app.twin.opening = session ? '' : 'No recording is open.';
    note(app, 'The recording cannot be opened.', [(problem as Error).message], 'error');
  }
}

export function openFiles(app: App, files: { name: string; file: File }[], place: 'first' | 'second'): Promise<void> {
  return open(app, place, (progress) => openDropped(files, progress), '');
}

// What the address of the page names: ?bag=ADDRESS, &bag2= a second one, &t= the time in seconds.
export async function openAddress(app: App): Promise<void> {
  const asked = new URLSearchParams(location.search);
  const first = asked.get('bag')!;
  await open(app, 'first', (progress) => openBagAt(first, progress), first, Number(asked.get('t')) || 0);
  const second = asked.get('bag2');
  if (second && session) await open(app, 'second', (progress) => openBagAt(second, progress), second);
}
