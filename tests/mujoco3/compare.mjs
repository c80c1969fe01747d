// Exported MJCF in MuJoCo 3, against the twin's own motion: prints the largest difference of any joint in 0.5 s, and exits
// with 1 where it is larger than allowed.
//   node compare.mjs DOPPEL BENCH_TRUTH FOLDER ROBOT...
// FOLDER is one in which `npm ci` has installed the package `mujoco`.
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {basename, dirname, join, resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

const STEP = 1e-3;          // s, of the export and of the twin
const EULER = 0;            // mjINT_EULER
const IMPLICIT_FAST = 3;    // mjINT_IMPLICITFAST: MuJoCo 2 has none, so the export cannot name it
const NO_ACTUATION = 1 << 11, NO_EULER_DAMPING = 1 << 15;  // mjtDisableBit

// Two ways to step. `twin`: the twin's own scheme, in which the dampers are in the matrix that constraints are solved
// with; its difference is that of the models alone. `implicitfast`: MuJoCo's, whose constraints do not see the dampers;
// its difference is that of two integrators of first order (docs/physics.md).
const SCHEMES = {
  twin: {allowed: {fall: 1e-4, hold: 1e-4}},
  implicitfast: {allowed: {fall: 2e-3, hold: 3e-4}},
};

const [doppel, benchTruth, folder, ...robots] = process.argv.slice(2);
const entry = join(resolve(folder), 'node_modules/mujoco/mujoco.js');
const mujoco = await (await import(pathToFileURL(entry).href)).default();

// The model of an MJCF file whose meshes are copied into the module's own file system.
function load(file) {
  let text = readFileSync(file, 'utf8');
  let count = 0;
  text = text.replace(/(<mesh [^>]*file=")([^"]+)"/g, (_, start, path) => {
    const name = `${count++}_${basename(path)}`;
    mujoco.FS.writeFile(`/${name}`, readFileSync(resolve(dirname(file), path)));
    return `${start}${name}"`;
  });
  mujoco.FS.writeFile('/robot.xml', text);
  return mujoco.MjModel.mj_loadXML('/robot.xml');
}

// Puts the dampers of joints and drives into the inertia, for one step: (M + h D) dv = h (tau - D v).
function stepAsTwin(model, joints, holds) {
  model.opt.disableflags |= NO_EULER_DAMPING;
  const damping = new Map(joints.map((name) => [name, model.jnt(name).damping[0]]));
  for (let i = 0; holds && i < model.nu; ++i) {
    const {name, biasprm} = model.actuator(i);
    damping.set(name, damping.get(name) - biasprm[2]);
  }
  for (const [name, value] of damping) model.jnt(name).armature[0] += STEP * value;
}

function largestDifference(model, motion, holds, scheme) {
  const data = new mujoco.MjData(model);
  const address = motion.joints.map((name) => model.jnt(name).qposadr);
  const first = motion.samples[0].q;
  address.forEach((at, i) => { data.qpos[at] = first[i]; });
  for (let i = 0; i < model.nu; ++i) {
    const joint = motion.joints.indexOf(model.actuator(i).name);
    data.ctrl[i] = holds ? first[joint] : 0;
  }
  if (!holds) model.opt.disableflags |= NO_ACTUATION;
  model.opt.integrator = scheme === 'twin' ? EULER : IMPLICIT_FAST;
  if (scheme === 'twin') stepAsTwin(model, motion.joints, holds);
  let largest = 0;
  let worst = '';
  let step = 0;
  for (const {t, q} of motion.samples) {
    for (; step < Math.round(t / STEP); ++step) mujoco.mj_step(model, data);
    address.forEach((at, i) => {
      const difference = Math.abs(data.qpos[at] - q[i]);
      if (difference > largest) {
        largest = difference;
        worst = motion.joints[i];
      }
    });
  }
  data.delete();
  return {largest, worst};
}

let failed = false;
const work = mkdtempSync(join(tmpdir(), 'mujoco3-'));
console.log(`MuJoCo ${mujoco.mj_versionString()}; largest difference to the twin in 0.5 s, mrad or mm`);
for (const robot of robots) {
  const name = basename(robot).replace(/\.[a-z]+$/, '');
  const file = join(work, `${name}.xml`);
  const urdf = join(work, `${name}.urdf`);
  for (const out of [file, urdf]) execFileSync(doppel, ['convert', robot, '-o', out], {stdio: 'pipe'});
  for (const kind of ['fall', 'hold']) {
    const motion = JSON.parse(execFileSync(benchTruth, ['motion', urdf, kind], {encoding: 'utf8'}));
    for (const [scheme, {allowed}] of Object.entries(SCHEMES)) {
      const model = load(file);
      const {largest, worst} = largestDifference(model, motion, kind === 'hold', scheme);
      model.delete();
      const good = largest <= allowed[kind];
      failed ||= !good;
      console.log(`  ${name.padEnd(12)} ${kind}  ${scheme.padEnd(12)} ${(1e3 * largest).toExponential(2).padStart(9)}  ` +
                  `${worst}${good ? '' : '  TOO LARGE'}`);
    }
  }
}
rmSync(work, {recursive: true});
process.exit(failed ? 1 : 0);
