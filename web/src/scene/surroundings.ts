// Lights, background and sky of a world, as published on /doppel/scene.
import * as THREE from 'three';
import type { Message } from '../protocol/cdr';
import type { Stage } from './stage';

type Vector = { x: number; y: number; z: number };
type Colour = { r: number; g: number; b: number };
const KIND = { point: 0, directional: 1, spot: 2 }; // doppel_msgs/Light
const LIT = Math.PI; // the irradiance at which three.js shows a white surface white

function colourOf(message: unknown): THREE.Color {
  const { r, g, b } = message as Colour;
  return new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
}

function vectorOf(message: unknown): THREE.Vector3 {
  const { x, y, z } = message as Vector;
  return new THREE.Vector3(x, y, z);
}

// three.js has 1 / d^decay: the same power as the largest term of SDF's divisor, and the same light at half the range.
export function attenuationOf(light: Message): { decay: number; factor: number } {
  const [constant, linear, quadratic] = ['constant', 'linear', 'quadratic'].map((name) => Number(light[`attenuation_${name}`])) as [number, number, number];
  const decay = quadratic > 0 ? 2 : linear > 0 ? 1 : 0;
  const d = Math.max(Number(light['range']) / 2, 1e-3);
  const divisor = constant + linear * d + quadratic * d * d;
  return { decay, factor: d ** decay / (divisor > 0 ? divisor : 1) };
}

function lampOf(light: Message): THREE.Light[] {
  const colour = colourOf(light['diffuse']);
  const range = Number(light['range']);
  const { decay, factor } = attenuationOf(light);
  const intensity = LIT * Number(light['intensity']) * factor;
  const at = vectorOf(light['position']);
  if (Number(light['kind']) === KIND.point) {
    const lamp = new THREE.PointLight(colour, intensity, range, decay);
    lamp.position.copy(at);
    return [lamp];
  }
  const outer = Math.min(Math.max(Number(light['outer_angle']) / 2, 0.01), Math.PI / 2);
  const inner = Math.min(Number(light['inner_angle']) / 2, outer);
  const lamp = new THREE.SpotLight(colour, intensity, range, outer, 1 - inner / outer, decay);
  lamp.position.copy(at);
  lamp.target.position.copy(at).add(vectorOf(light['direction']));
  return [lamp];
}

// The share of daylight, 0 to 1, an hour around sunrise and sunset.
export function daylight(time: number, sunrise: number, sunset: number): number {
  const rise = THREE.MathUtils.smoothstep(time, sunrise - 0.5, sunrise + 0.5);
  return rise * (1 - THREE.MathUtils.smoothstep(time, sunset - 0.5, sunset + 0.5));
}

function skyOf(scene: Message): THREE.Texture {
  const day = daylight(Number(scene['time']), Number(scene['sunrise']), Number(scene['sunset']));
  const low = Math.sin(Math.PI * day); // at its highest while the sun rises or sets
  const mixed = (night: string, noon: string, dusk: string): string =>
    `#${new THREE.Color(night).lerp(new THREE.Color(noon), day).lerp(new THREE.Color(dusk), 0.7 * low).getHexString()}`;
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [1024, 512]; // three.js makes reflections from a picture of this shape only
  const context = canvas.getContext('2d')!;
  const fill = context.createLinearGradient(0, 0, 0, canvas.height);
  fill.addColorStop(0, mixed('#050914', '#2f6fc4', '#33456e'));
  fill.addColorStop(0.47, mixed('#101827', '#b9d3ee', '#e0925c'));
  fill.addColorStop(0.5, mixed('#131a24', '#d9e4ee', '#d8a27c'));
  fill.addColorStop(0.52, mixed('#0c0e10', '#8d938f', '#5c4c45'));
  fill.addColorStop(1, mixed('#070808', '#6c716d', '#3c3531'));
  context.fillStyle = fill;
  context.fillRect(0, 0, canvas.width, canvas.height);
  const texture = new THREE.CanvasTexture(canvas);
  texture.mapping = THREE.EquirectangularReflectionMapping;
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}

export class Surroundings {
  // The surroundings that metals reflect; without them metals are black.
  reflection = skyOf({ time: 12, sunrise: 6, sunset: 20 });
  private readonly lamps: THREE.Object3D[] = [];

  constructor(private readonly stage: Stage) {}

  show(message: Message): void {
    const { stage } = this;
    stage.scene.remove(...this.lamps.splice(0));
    const lights = message['lights'] as Message[];
    const environment = message['has_environment'] === true;
    const suns = lights.filter((light) => Number(light['kind']) === KIND.directional);
    // The first sun, or the first that casts shadows, is the one that the stage has shadows for.
    const main = suns.find((light) => light['cast_shadows'] === true) ?? suns[0];
    for (const light of lights) {
      if (light === main) continue;
      if (Number(light['kind']) === KIND.directional) {
        const lamp = new THREE.DirectionalLight(colourOf(light['diffuse']), LIT * Number(light['intensity']));
        lamp.position.copy(vectorOf(light['direction']).multiplyScalar(-1));
        this.lamps.push(lamp);
      } else {
        const [lamp] = lampOf(light);
        this.lamps.push(lamp!);
        if (lamp instanceof THREE.SpotLight) this.lamps.push(lamp.target);
      }
    }
    if (this.lamps.length > 0) stage.scene.add(...this.lamps);
    stage.lightBy(lights.length === 0 && !environment ? null : {
      sun: main ? { colour: colourOf(main['diffuse']), intensity: LIT * Number(main['intensity']), direction: vectorOf(main['direction']), shadows: main['cast_shadows'] === true } : null,
      ambient: environment ? colourOf(message['ambient']) : new THREE.Color().setRGB(0.4, 0.4, 0.4, THREE.SRGBColorSpace),
      ambientIntensity: LIT,
      shadows: !environment || message['shadows'] === true,
    });
    const sky = environment && message['sky'] === true ? skyOf(message) : null;
    if (sky) this.reflection = sky;
    stage.scene.background = !environment ? null : sky ?? colourOf(message['background']);
    stage.scene.backgroundRotation.set(Math.PI / 2, 0, 0); // the texture has y upwards
    stage.moved();
  }
}
