// Two recordings at the same time since their starts: the second robot as a ghost, and the difference of each joint's
// position.
import type { App } from '../app/app';
import { button, fill, h } from '../app/dom';
import { curveWanted, Recorder } from '../app/recorder';
import { settings, settingsChanged } from '../app/settings';
import { Twin } from '../app/twin';
import type { Tree, TreeJoint } from '../robot/tree';
import type { RobotView } from '../robot/view';
import { cssColour } from '../scene/legend';
import type { Bag } from './bag';
import type { Playback } from './playback';
import { residualOf, type Residual } from './residual';
import { BagSource } from './source';
import { Survey } from './survey';

const COLOUR = 0x9467bd;
const OPACITY = 0.45;
const MOST_CURVES = 8; // that are shown at first
const CURVES_OF_ONE = 3; // and again after the comparison

const keyOf = (joint: TreeJoint): string => `residual:${joint.name}`;
const positionOf = (joint: TreeJoint): string => `joint:${joint.name}:position`;

export class Comparison {
  readonly twin = Twin.forRecording();
  readonly survey: Survey;
  view: RobotView | null = null;
  private readonly recorder: Recorder;
  private readonly ends: (() => void)[];
  private joints: TreeJoint[] = []; // of both robots
  private isListed = false;

  constructor(
    private readonly app: App,
    private readonly playback: Playback,
    private readonly first: Survey,
    readonly bag: Bag,
  ) {
    const { twin } = this;
    this.recorder = new Recorder(twin, { reference: () => NaN, tolerance: () => NaN });
    this.survey = new Survey(bag, this.recorder, () => playback.isPlaying || playback.isReading);
    const source = new BagSource(bag);
    twin.robotChanged.on((tree) => this.build(tree));
    twin.moved.on(() => this.place());
    twin.read(source);
    source.start();
    this.ends = [
      playback.follow(source),
      first.changed.on(() => this.show()),
      this.survey.changed.on(() => this.listJoints()),
      settingsChanged.on((key) => key === 'degrees' && this.show()),
    ];
    app.legend.show('compared', { key: 'line', colour: cssColour(COLOUR), label: bag.name, value: 'ghost' });
    this.show();
    // Its curves are read before those of the differences.
    this.survey.twin.robotChanged.on((tree) => {
      for (const joint of tree.moving) this.recorder.joint(joint, 'position');
    });
    this.survey.begin();
  }

  end(): void {
    for (const end of this.ends) end();
    this.survey.stop();
    this.view?.root.removeFromParent();
    this.app.legend.show('compared', null);
    for (const joint of this.joints) curveWanted.emit({ key: keyOf(joint), on: false });
    for (const joint of this.joints.slice(0, CURVES_OF_ONE))
      curveWanted.emit({ key: this.app.recorder.joint(joint, 'position').key, on: true });
    fill(this.app.comparison);
    this.app.tabsChanged.emit();
    this.app.world.stage.invalidate();
  }

  private build(tree: Tree): void {
    const { world } = this.app;
    this.view?.root.removeFromParent();
    const hasMeshes = this.bag.files.some(({ attachments }) => attachments.length > 0);
    this.view = world.addGhost(tree, hasMeshes ? this.twin.client : null, COLOUR, OPACITY);
    this.place();
  }

  private place(): void {
    this.view?.place(this.twin.poses);
    this.app.world.stage.invalidate();
  }

  // The joints of both robots, once the second recording is read.
  private listJoints(): void {
    const { tree } = this.survey.twin;
    if (this.isListed || !this.survey.isComplete) {
      this.show();
      return;
    }
    this.isListed = true;
    this.joints = (this.app.twin.tree?.moving ?? []).filter(
      (joint) => !joint.mimic && tree?.jointByName.has(joint.name),
    );
    for (const joint of this.joints) {
      const slides = joint.kind === 'prismatic';
      this.app.recorder.computed(keyOf(joint), `${joint.name} difference`, slides ? 'm' : 'rad', () =>
        this.difference(joint),
      );
    }
    curveWanted.emit({ key: '', on: false });
    for (const joint of this.joints.slice(0, MOST_CURVES)) curveWanted.emit({ key: keyOf(joint), on: true });
    this.show();
  }

  // Of the position in the first recording to that in the second one, at the time that the survey has reached.
  private difference(joint: TreeJoint): number {
    const { twin, time } = this.first;
    const index = twin.tree?.jointByName.get(joint.name)?.index ?? -1;
    return index < 0 ? NaN : twin.q[index]! - this.recorder.valueAt(positionOf(joint), time);
  }

  private show(): void {
    const { comparison, tabsChanged } = this.app;
    const close = button('Close', 'Close the second recording', () => this.end(), { id: 'bag-close-second' });
    const title = h('strong', {}, `${this.first.bag.name} − ${this.bag.name}`);
    const note = this.note();
    fill(
      comparison,
      h('div', { class: 'row' }, title, h('span', { class: 'spacer' }), close),
      note ? h('p', { class: 'empty' }, note) : this.table(),
    );
    tabsChanged.emit();
  }

  private table(): HTMLElement[] {
    let samples = 0;
    const rows = this.joints.map((joint) => {
      const key = keyOf(joint);
      const [times, values] = this.app.recorder.window(-Infinity, Infinity, [key]) as [Float64Array, Float64Array];
      const residual = residualOf(times, values);
      samples = Math.max(samples, residual.count);
      return this.row(joint, residual);
    });
    const head = ['joint', 'largest', 'at', 'rms', ''].map((title) => h('th', { scope: 'col' }, title));
    return [
      h('table', { class: 'residuals' }, h('thead', {}, h('tr', {}, head)), h('tbody', {}, rows)),
      h('p', { class: 'muted' }, `${samples} samples, at the same time since the start of each recording.`),
    ];
  }

  private row(joint: TreeJoint, { largest, time, rms }: Residual): HTMLElement {
    const seek = (): void => this.playback.seek(time);
    const plot = (): void => curveWanted.emit({ key: keyOf(joint), on: true });
    const link = button(`${time.toFixed(2)} s`, 'Go to this time', seek, { class: 'plain link-button' });
    return h(
      'tr',
      {},
      h('th', { scope: 'row' }, joint.name),
      h('td', { class: 'num' }, this.text(joint, Math.abs(largest))),
      h('td', { class: 'num' }, Number.isFinite(time) ? link : '–'),
      h('td', { class: 'num' }, this.text(joint, rms)),
      h('td', {}, button('plot', `Plot the difference of ${joint.name}`, plot, { class: 'small' })),
    );
  }

  // Why there is no table yet; '' if there is one.
  private note(): string {
    if (!this.survey.isComplete)
      return `Reading ${this.bag.name}: ${((this.survey.done / Math.max(1e-9, this.bag.length)) * 100).toFixed(0)} %.`;
    if (!this.survey.twin.tree) return `${this.bag.name} has no /robot_description.`;
    if (this.joints.length === 0) return 'The two robots have no joint of the same name.';
    return this.first.isComplete
      ? ''
      : `Comparing: ${((this.first.done / Math.max(1e-9, this.first.bag.length)) * 100).toFixed(0)} %.`;
  }

  private text(joint: TreeJoint, value: number): string {
    if (!Number.isFinite(value)) return '–';
    if (joint.kind === 'prismatic') return `${(value * 1000).toFixed(3)} mm`;
    return settings.degrees ? `${((value * 180) / Math.PI).toFixed(4)}°` : `${value.toFixed(6)} rad`;
  }
}
