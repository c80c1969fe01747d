// The start of the page: connects at once and requests the robot's meshes; the rest is loaded meanwhile.
import '../style/base.css';
import '../style/layout.css';
import '../style/panels.css';
import '../style/loop.css';
import { AssetStore } from '../robot/assets';
import { Twin } from './twin';

performance.mark('doppel: script');
const ROBOT_TIMEOUT = 250; // ms after which the picture is set up without the robot

function serverUrl(): string {
  const asked = new URLSearchParams(location.search);
  const token = asked.get('token');
  const base = asked.get('ws') ?? `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`;
  return token ? `${base}${base.includes('?') ? '&' : '?'}token=${encodeURIComponent(token)}` : base;
}

const twin = new Twin(serverUrl());
const assets = new AssetStore(twin.client);
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
twin.start();
void Promise.all([import('./page'), known]).then(([{ startPage }]) => startPage(twin, assets));
