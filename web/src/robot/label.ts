// A text in the picture.
import * as THREE from 'three';

export function label(text: string, colour: string, size: number): THREE.Sprite {
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d')!;
  const font = '500 28px system-ui, sans-serif';
  context.font = font;
  canvas.width = Math.ceil(context.measureText(text).width) + 12;
  canvas.height = 40;
  context.font = font;
  context.lineWidth = 5;
  context.strokeStyle = document.documentElement.dataset['theme'] === 'dark' ? '#14171acc' : '#ffffffcc';
  context.strokeText(text, 6, 29);
  context.fillStyle = colour;
  context.fillText(text, 6, 29);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture, depthTest: false, transparent: true, sizeAttenuation: true }));
  sprite.scale.set((size * canvas.width) / canvas.height, size, 1);
  sprite.center.set(0, 0);
  sprite.renderOrder = 10;
  return sprite;
}
