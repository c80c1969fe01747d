// A location in a source, shortened, with the full text to copy.
import { copyText } from './clipboard';
import { button, h } from './dom';
import { placeText, type Place } from './sources';

export function placeLabel(place: Place): HTMLElement {
  const text = placeText(place);
  const short = text.slice(place.file.lastIndexOf('/') + 1);
  return h('span', { class: 'source' }, h('code', { title: text }, short), button('Copy', `Copy ${text}`, () => void copyText(text, short), { class: 'small' }));
}
