// Everything besides the picture: tools that command the arm, keys, panels.
import type { App, Panel } from './app';
import type { Layout } from './layout';
import { h } from './dom';
import { Calibration } from './calibration';
import { Devices } from './devices';
import { Drive } from './drive';
import { makeHints } from './hints';
import { Jog } from './jog';
import { startKeyboard } from './keyboard';
import { startLinkedPose } from './linked_pose';
import { Parameters } from './parameters';
import { Reach } from './reach';
import { chooseRecording, startRecordings } from './recordings';
import { Recorder } from './recorder';
import { Sensors } from './sensors';
import type { Signal } from './signal';
import { Tolerances } from './tolerances';
import { ToolDriver } from './tool';
import { Validation } from './validation';
import { calibratePanel } from '../panels/calibrate';
import { controlPanel } from '../panels/control';
import { drivePanel } from '../panels/drive';
import { hardwarePanel } from '../panels/hardware';
import { healthPanel } from '../panels/health';
import { jointsPanel } from '../panels/joints';
import { logPanel } from '../panels/log';
import { objectsPanel } from '../panels/objects';
import { parametersPanel } from '../panels/parameters';
import { plotsPanel } from '../panels/plots';
import { posesPanel } from '../panels/poses';
import { sensorsPanel } from '../panels/sensors';
import { tfPanel } from '../panels/tf';
import { toolPanel } from '../panels/tool';
import { topicsPanel } from '../panels/topics';
import { treePanel } from '../panels/tree';
import { validatePanel } from '../panels/validate';
import { BaseTrace } from '../scene/base_trace';
import { CalibrationGhost } from '../scene/calibration_ghost';
import { ContactLayer } from '../scene/contacts';
import { EvidenceGhost } from '../scene/evidence_ghost';
import { GoalGhost } from '../scene/goal_ghost';
import { ToolHandle } from '../scene/handle';
import { KeepOutBoxes } from '../scene/keep_out';
import { ObjectLayer } from '../scene/objects';
import { Legend } from '../scene/legend';
import { Picker } from '../scene/picking';
import { Pusher } from '../scene/push';
import { ReachPoints } from '../scene/reach_points';
import { SensorLayers } from '../scene/sensor_layers';
import { TwinGhost } from '../scene/twin_ghost';

const COMMANDS = ['control', 'tool', 'drive', 'poses', 'parameters']; // panels without use in a recording

export function startWorkbench(app: App, layout: Layout): void {
  const picker = new Picker(app.world);
  const pusher = new Pusher(app, picker);
  const driver = new ToolDriver(app);
  const handle = new ToolHandle(app, driver);
  const jog = new Jog(app, driver);
  const drive = new Drive(app);
  app.twin.selectedRobot.on(() => app.select(null));
  new ContactLayer(app);
  const legend = new Legend();
  app.world.stage.host.append(legend.element);
  const baseTrace = new BaseTrace(app, legend);
  const ghost = new GoalGhost(app, driver);
  const evidence = new EvidenceGhost(app, driver, legend);
  const devices = new Devices(app.twin);
  const twinGhost = new TwinGhost(app, driver, devices, legend);
  const calibration = new Calibration(app.twin);
  const calibrationGhost = new CalibrationGhost(app, legend);
  const keepOut = new KeepOutBoxes(app);
  const validation = new Validation(app.twin);
  const reach = new Reach(app, driver.kinematics);
  const reachPoints = new ReachPoints(app, reach, legend);
  const objects = new ObjectLayer(app, picker);
  const sensors = new Sensors(app.twin);
  const sensorPictures = new SensorLayers(app, sensors, legend);
  app.worldLayers = () => keepOut.offered();
  app.sensorLayers = () => sensorPictures.offered();
  const parameters = new Parameters(app.twin.client);
  const tolerances = new Tolerances(app.twin, parameters);
  const recorder = new Recorder(app.twin, tolerances);
  startKeyboard(app, jog);
  startRecordings(app);
  startLinkedPose(app);

  const comparison = h('div', { class: 'padded' });
  const comparePanel: Panel = { id: 'compare', title: 'Compare', element: comparison, excluded: () => !comparison.hasChildNodes() }; // filled by src/bag
  const right: Panel[] = [jointsPanel(app), comparePanel, healthPanel(app), hardwarePanel(app, devices, evidence), calibratePanel(app, calibration, devices, calibrationGhost), validatePanel(app, validation, evidence), controlPanel(app), toolPanel(app, { driver, handle, ghost, reach, jog, pusher }), drivePanel(app, drive, jog), sensorsPanel(app, sensors), posesPanel(app), objectsPanel(app, objects), treePanel(app)];
  const bottom: Panel[] = [plotsPanel(app, recorder, parameters), topicsPanel(app), parametersPanel(app, parameters), tfPanel(app), logPanel(app)];
  for (const panel of [...right, ...bottom]) if (COMMANDS.includes(panel.id)) panel.excluded = () => app.twin.isReadOnly;
  layout.mount(right, bottom);
  const hints = makeHints(new URLSearchParams(location.search).has('bag'));
  if (hints) {
    app.world.stage.host.append(hints);
    app.twin.controllersChanged.on(() => { hints.hidden = app.twin.isDrivenElsewhere; }); // they are about commands
  }
  app.openPanel = (id) => layout.open(id);
  app.chooseRecording = () => chooseRecording(app);
  // A lost twin keeps its tabs.
  const refresh = (): void => {
    if (app.twin.client.phase === 'open') layout.refresh();
  };
  for (const signal of [app.twin.graphChanged, app.twin.controllersChanged, sensors.changed, objects.listChanged, app.tabsChanged] as Signal<unknown>[]) signal.on(refresh);
  if (location.hash === '#drive') layout.open('drive'); // the address that `doppel teleop page` prints

  let down: { x: number; y: number } | null = null;
  const canvas = app.world.stage.renderer.domElement;
  objects.placingChanged.on((placing) => handle.stepAside(placing));
  canvas.addEventListener('pointerdown', (event) => {
    down = null;
    if (event.button !== 0 || handle.busy || objects.busy) return;
    const hit = pusher.armed || event.altKey ? picker.hit(event) : null;
    if (hit) {
      pusher.begin(hit);
      if (pusher.active) canvas.setPointerCapture(event.pointerId);
    } else {
      down = { x: event.clientX, y: event.clientY };
    }
  }, true);
  canvas.addEventListener('pointermove', (event) => pusher.move(event));
  for (const name of ['pointercancel', 'lostpointercapture']) canvas.addEventListener(name, () => pusher.end());
  canvas.addEventListener('pointerup', (event) => {
    pusher.end();
    if (!down || Math.hypot(event.clientX - down.x, event.clientY - down.y) > 4) return;
    const hit = objects.placing ? null : picker.hit(event);
    const other = objects.placing ? null : app.world.others.hit(picker.rayAt(event));
    const here = hit ? hit.point.distanceTo(app.world.stage.camera.position) : Infinity;
    if (objects.click(event, Math.min(here, other?.distance ?? Infinity))) return;
    app.select(hit && !(other && other.distance < here) ? { link: hit.link } : null);
    if (other && other.distance < here) app.twin.selectRobot(other.space);
  });
  Object.assign(app, { driver, handle, ghost, twinGhost, devices, calibration, calibrationGhost, keepOut, evidence, validation, reach, reachPoints, jog, drive, baseTrace, sensors, sensorPictures, pusher, objects, parameters, recorder, comparison, legend, ready: true });
}
