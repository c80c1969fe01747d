// The bar at the top: the robot, connection, time and its controls, theme, and the emergency stop at the right end.
import type { App } from './app';
import { button, fill, h, say, toast } from './dom';
import { icon, setIcon } from './icons';
import { set, settings, settingsChanged } from './settings';
import { callSimulation, resetSimulation } from './simulation';
import { seconds } from './units';

const SPEEDS: [string, number][] = [['0.1×', 0.1], ['0.25×', 0.25], ['0.5×', 0.5], ['1×', 1], ['2×', 2], ['5×', 5], ['max', 0]];

export function makeBar(app: App, openSettings: () => void): { element: HTMLElement; update: () => void } {
  const { twin, commander } = app;
  const name = h('strong', { class: 'robot-name' }, 'doppel');
  // Shown instead of the name where there are several robots.
  const robot = h('select', { 'aria-label': 'Robot of the panels and commands', title: 'Robot of the panels and commands', id: 'robot', hidden: true, onchange: () => twin.selectRobot(robot.value) });
  const listRobots = (): void => {
    fill(robot, twin.robots.map((space) => h('option', { value: space, selected: space === twin.space }, space === '' ? '(no namespace)' : space.slice(1))));
    robot.hidden = twin.robots.length < 2;
    name.hidden = !robot.hidden;
  };
  twin.robotsChanged.on(listRobots);
  twin.selectedRobot.on(listRobots);
  const link = h('span', { class: 'link', role: 'status' }, 'connecting');
  const play = button(icon('pause'), 'Pause (P)', () => {
    callSimulation(twin, twin.paused ? '/gazebo/unpause_physics' : '/gazebo/pause_physics');
  }, { class: 'icon', id: 'play' });
  const step = button(icon('step'), 'One step of physics, 1 ms; with shift a tenth of a second', () => {}, { class: 'icon', id: 'step' });
  step.addEventListener('click', (event) => callSimulation(twin, '/gazebo/step', { steps: event.shiftKey ? 100 : 1 }, (answer) => twin.knowTime(Number(answer['sim_time']))));
  const reset = button(icon('reset'), 'Reset: time and joints back to the start', () => resetSimulation(app), { class: 'icon', id: 'reset' });
  const speed = h('select', { 'aria-label': 'Speed of simulated time', title: 'Speed of simulated time', id: 'speed', onchange: () => callSimulation(twin, '/gazebo/set_speed', { factor: Number(speed.value) }) },
    ...SPEEDS.map(([label, value]) => h('option', { value: String(value), selected: value === 1 }, label)));
  const other = h('option', { hidden: true }); // a speed that another client has set
  speed.append(other);
  twin.statusChanged.on((status) => {
    if (!status || document.activeElement === speed) return;
    if (!SPEEDS.some(([, value]) => value === status.speed)) {
      other.value = String(status.speed);
      say(other, `${+status.speed.toFixed(3)}×`);
    }
    if (speed.value !== String(status.speed)) speed.value = String(status.speed);
  });
  const time = h('output', { class: 'num time', title: 'simulated time' });
  const factor = h('output', { class: 'num factor', title: 'real-time factor: simulated seconds in one second' });
  const theme = button(icon('theme'), 'Theme: as the system, light, dark', () => {
    const next = { system: 'light', light: 'dark', dark: 'system' } as const;
    set('theme', next[settings.theme]);
    toast(`Theme: ${settings.theme}`);
  }, { class: 'icon', id: 'theme' });
  const more = button(icon('settings'), 'Settings and keys', openSettings, { class: 'icon', id: 'settings' });
  const readOnly = h('span', { class: 'tag', hidden: true, title: 'This is a recording: nothing in it can be commanded, and STOP has nothing to stop.' }, 'read only');
  const emulated = h('span', { class: 'tag', hidden: true, title: 'An arm behind a port: the program at that port drives it, and has its STOP.' }, 'emulated');
  const stop = h('button', { type: 'button', class: 'stop', id: 'stop', title: `Emergency stop (${settings.stopKeys.join(', ')})`, onclick: () => void (commander.stopped ? commander.resetStop() : commander.stop()) }, 'STOP');
  const clock = h('div', { class: 'group clock', role: 'group', 'aria-label': 'Time' }, reset, play, step, speed, time, factor);
  const element = h('header', { class: 'bar' },
    h('div', { class: 'brand' }, name, robot, link), clock, h('span', { class: 'spacer' }), h('div', { class: 'group last' }, readOnly, emulated, theme, more), stop);

  // Without a connection the button keeps the stop for the next one, and shows that nothing is stopped yet.
  const nameStop = (): void => {
    const lost = twin.client.phase === 'lost';
    stop.classList.toggle('offline', lost);
    stop.title = lost ? (commander.stopped ? 'Do not send the stop' : 'Stop the twin as soon as the connection is back')
      : commander.stopped ? 'Reset the emergency stop' : `Emergency stop (${settings.stopKeys.join(', ')})`;
  };
  twin.phaseChanged.on(nameStop);
  settingsChanged.on(nameStop);
  commander.stopChanged.on((stopped) => {
    say(stop, stopped ? 'Reset STOP' : 'STOP');
    stop.classList.toggle('pressed', stopped);
    stop.setAttribute('aria-pressed', String(stopped));
    document.body.classList.toggle('stopped', stopped);
    nameStop();
  });
  const update = (): void => {
    const { client } = twin;
    const called = (twin.robots.length > 0 && twin.tree?.robot.name) || 'doppel';
    say(name, called);
    const state = client.phase === 'lost' ? 'lost' : commander.stopped ? 'stopped' : twin.paused ? 'paused' : '';
    const label = twin.isEmulated ? `${called}, emulated` : called; // its driver's page is open beside it
    const title = state ? `${label} – ${state}` : label;
    if (document.title !== title) document.title = title;
    const recorded = twin.isReadOnly && client.phase !== 'lost';
    stop.hidden = recorded || twin.isDrivenElsewhere;
    readOnly.hidden = !recorded;
    emulated.hidden = !twin.isEmulated;
    const phase = recorded ? (twin.recording ? `recording ${twin.recording}` : 'no recording') : client.phase === 'open' ? (commander.viewing ? 'kinematics' : 'connected') : client.phase === 'lost' ? 'connection lost' : 'connecting';
    say(link, phase);
    link.className = `link ${recorded ? 'recorded' : client.phase}`;
    link.title = twin.recording;
    const simulated = client.services.has('/gazebo/pause_physics');
    if (client.phase !== 'lost') clock.hidden = !simulated;
    setIcon(play, twin.paused ? 'play' : 'pause');
    const action = twin.paused ? 'Play (P)' : 'Pause (P)';
    if (play.title !== action) {
      play.title = action;
      play.setAttribute('aria-label', action);
    }
    say(time, seconds(twin.simTime));
    const { status } = twin;
    const slow = status !== null && !status.paused && status.speed > 0 && status.realTimeFactor < status.speed * 0.9;
    say(factor, !status ? '–' : status.paused ? 'paused' : `${status.realTimeFactor.toFixed(2)}×${slow ? ' slow' : ''}`);
    factor.classList.toggle('slow', slow);
  };
  return { element, update };
}
