// The start of the page: connects at once and requests the robot's meshes; the rest is loaded meanwhile.
import '../style/base.css';
import '../style/layout.css';
import '../style/panels.css';
import '../style/loop.css';
import '../style/bag.css';
import { BUNDLE_PERIOD } from '../protocol/bundle';
import { Client } from '../protocol/client';
import { AssetStore } from '../robot/assets';
import { Twin } from './twin';

performance.mark('doppel: script');
const ROBOT_TIMEOUT = 250; // ms after which the picture is set up without the robot

const asked = new URLSearchParams(location.search);
const own = !asked.has('ws');

function serverUrl(): string {
  const base = asked.get('ws') ?? `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`;
  const token = asked.get('token');
  const query = [token ? `token=${encodeURIComponent(token)}` : '', `bundle=${BUNDLE_PERIOD}`].filter(Boolean).join('&');
  return `${base}${base.includes('?') ? '&' : '?'}${query}`;
}

const twin = new Twin(new Client({ url: serverUrl() }));
const assets = new AssetStore(twin.client, own);
const known = new Promise<void>((done) => {
  setTimeout(done, ROBOT_TIMEOUT);
  twin.robotChanged.on(({ robot }) => {
    performance.mark('doppel: description');
    for (const link of robot.links.values()) {
      for (const { geometry } of link.visuals) if (geometry.kind === 'mesh') assets.prefetch(geometry.uri);
    }
    done();
  });
});
const recorded = asked.has('bag');
const reader = recorded ? import('../bag/session') : null;
if (recorded) twin.opening = 'Opening the recording.';
else twin.start();
void Promise.all([import('./page'), recorded || known]).then(([{ startPage }]) => {
  const app = startPage(twin, assets);
  void reader?.then(({ openAddress }) => openAddress(app));
});
