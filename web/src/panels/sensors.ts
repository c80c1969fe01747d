// The sensors of the twin with their rates and what they measure, as long as it is visible; and which of them the
// picture shows.
import type { App, Panel } from '../app/app';
import { button, fill, h, say, toggle } from '../app/dom';
import { LayerToggles } from '../app/layer_toggles';
import { Seen } from '../app/seen';
import { pictureTopics, shortTopics, type Sensor, type Sensors } from '../app/sensors';
import { set, settings } from '../app/settings';
import { Subscriptions, type Wanted } from '../app/subscriptions';
import { VIEWS, type View } from './sensor_views';

export function rateText(rate: number): string {
  return rate > 0 ? `${+rate.toPrecision(4)} Hz` : 'every step';
}

class Card {
  readonly element: HTMLElement;
  topic = ''; // of the view; '': there is none
  view: View | null = null; // null: the sensor is not shown
  private state = ''; // of the view
  private readonly asked = h('dd', { class: 'num' });
  private readonly reached = h('dd', { class: 'num' });
  private readonly leftOut = h('dd', { class: 'num' });
  private readonly body = h('div', { class: 'sensor-body' });
  private readonly where = h('span', { class: 'sensor-topic' });
  private readonly rates = h('dl', { class: 'rates' }, h('div', {}, h('dt', {}, 'target'), this.asked), h('div', {}, h('dt', {}, 'measured'), this.reached),
    h('div', { title: 'Samples that took too long' }, h('dt', {}, 'dropped'), this.leftOut));

  constructor(public sensor: Sensor, private readonly sensors: Sensors) {
    const parts = sensor.name.split('/');
    const name = parts.pop()!;
    this.element = h('section', { class: 'sensor', 'aria-label': sensor.name },
      h('div', { class: 'row' }, h('strong', {}, name), h('span', { class: 'tag' }, sensor.type), h('span', { class: 'spacer' }),
        toggle('Show', 'Here and, where a layer has it, in the picture', sensors.shown(sensor), (on) => sensors.show(this.sensor, on))),
      h('div', { class: 'muted sensor-about', title: sensor.topics.join('\n') }, parts.join('/'), parts.length > 0 ? ' · ' : '', this.where),
      this.rates, this.body);
    this.fill();
    this.report(sensor);
  }

  // The views of the sensor's topics; the first one unless another was chosen.
  fill(): void {
    const { sensors, sensor } = this;
    const pictures = pictureTopics(sensor.topics, sensors.schema);
    const topics = pictures.length > 0 ? pictures : sensor.topics.filter((topic) => VIEWS[sensors.schema(topic)]);
    const shown = sensors.shown(sensor);
    const topic = topics.includes(this.topic) ? this.topic : topics[0] ?? '';
    const state = [shown, topic, ...topics.map((one) => one + sensors.schema(one))].join(' ');
    if (state === this.state) return; // a picture that is shown stays
    this.state = state;
    say(this.where, topic || sensor.topics[0] || 'no topic');
    this.view?.stop();
    this.view = null;
    this.topic = topic;
    this.body.hidden = !shown;
    fill(this.body);
    if (!shown) return;
    this.view = VIEWS[sensors.schema(topic)]?.(sensor.name) ?? null;
    const labels = shortTopics(topics);
    fill(this.body,
      topics.length > 1 ? h('div', { class: 'segments', role: 'group', 'aria-label': `Topics of ${sensor.name}` },
        topics.map((one, i) => button(labels[i]!, one, () => this.choose(one), { 'aria-pressed': String(one === topic) }))) : null,
      this.view?.element ?? h('p', { class: 'muted' }, 'The panel Topics shows the messages of this sensor.'));
  }

  private choose(topic: string): void {
    this.topic = topic;
    this.fill();
  }

  report(sensor: Sensor): void {
    this.sensor = sensor;
    this.rates.hidden = Number.isNaN(sensor.rate);
    say(this.asked, rateText(sensor.rate));
    say(this.reached, sensor.reached > 0 ? `${sensor.reached.toFixed(1)} Hz` : 'not read');
    say(this.leftOut, String(sensor.leftOut));
    this.leftOut.classList.toggle('warning', sensor.leftOut > 0);
  }
}

// The layers of the picture that have something to show, and the value that points are coloured by.
function layerRow(app: App): { element: HTMLElement; update: () => void } {
  const row = h('div', { class: 'row' });
  const toggles = new LayerToggles(row, () => app.world);
  const colour = h('select', { 'aria-label': 'Points are coloured by', onchange: () => set('pointColour', colour.value as typeof settings.pointColour) },
    [['range', 'range'], ['intensity', 'intensity']].map(([value, text]) => h('option', { value, selected: value === settings.pointColour }, text)));
  const points = h('label', { class: 'setting' }, h('span', {}, 'Points are coloured by'), colour);
  const element = h('div', { class: 'sensor-layers' }, h('h3', {}, 'In the picture'), row, points);
  return {
    element,
    update: () => {
      const offered = app.sensorLayers();
      element.hidden = offered.length === 0;
      points.hidden = !offered.some(({ id }) => id === 'lidar' || id === 'clouds');
      toggles.offer(offered);
    },
  };
}

export function sensorsPanel(app: App, sensors: Sensors): Panel {
  const subscriptions = new Subscriptions(app.twin.client);
  const list = h('div', { class: 'sensor-list' });
  const picture = layerRow(app);
  const seen = new Seen<Card>();
  let cards = new Map<string, Card>();
  let visible = false;

  // The sensors; those of the selected robot come first.
  function ordered(): Sensor[] {
    const { robots, space } = app.twin;
    const first = (sensor: Sensor): number => (robots.length > 1 && sensor.topics.some((topic) => topic.startsWith(`${space}/`)) ? 0 : 1);
    return [...sensors.list].sort((a, b) => first(a) - first(b));
  }

  function build(): void {
    const before = cards;
    cards = new Map(ordered().map((sensor) => [sensor.name, before.get(sensor.name) ?? new Card(sensor, sensors)]));
    for (const card of before.values()) if (!cards.has(card.sensor.name)) card.view?.stop();
    for (const sensor of sensors.list) {
      const card = cards.get(sensor.name)!;
      card.report(sensor);
      card.fill();
    }
    fill(list, cards.size > 0 ? [...cards.values()].map((card) => card.element)
      : h('p', { class: 'empty' }, app.twin.client.phase !== 'open' ? 'No connection.' : app.twin.recording ? 'This recording has no messages of sensors.' : 'This twin has no sensors. <sensor> in <gazebo reference="link"> of the description adds one.'));
    seen.watch([...cards.values()].map((card) => [card.element, card]));
    picture.update();
    follow();
  }

  // Data of what can be seen, and of a picture that is enlarged.
  function follow(): void {
    const wanted = new Map<string, Wanted>();
    for (const card of visible ? seen : []) {
      const { view, topic } = card;
      if (view) wanted.set(`${card.sensor.name} ${topic}`, { topic, handler: (message) => card.view?.take(message) });
    }
    subscriptions.want(wanted);
  }

  sensors.changed.on(() => build());
  app.twin.selectedRobot.on(() => build());
  app.twin.phaseChanged.on(() => build());
  sensors.reported.on(() => {
    for (const sensor of sensors.list) cards.get(sensor.name)?.report(sensor);
  });
  build();
  return {
    id: 'sensors', title: 'Sensors', rate: 10,
    applies: () => sensors.list.length > 0,
    element: h('div', { class: 'padded sensors' }, picture.element, list),
    update: () => {
      follow();
      for (const card of seen) card.view?.update();
    },
    shown: () => {
      visible = true;
      picture.update();
      follow();
    },
    hidden: () => {
      visible = false;
      follow();
      for (const card of cards.values()) card.view?.stop();
    },
  };
}
