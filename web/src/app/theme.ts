import { settings, settingsChanged } from './settings';
import type { World } from '../scene/world';

export function startTheme(world: World): void {
  const media = matchMedia('(prefers-color-scheme: dark)');
  const apply = (): void => {
    const dark = settings.theme === 'dark' || (settings.theme === 'system' && media.matches);
    document.documentElement.dataset['theme'] = dark ? 'dark' : 'light';
    world.theme(dark);
    dispatchEvent(new Event('themechange'));
  };
  media.addEventListener('change', apply);
  settingsChanged.on((key) => {
    if (key === 'theme') apply();
  });
  apply();
}
