import { App } from './app';
import { unstore } from './export';

const page = `<!doctype html>\n${document.documentElement.outerHTML}`;
const root = document.getElementById('app') as HTMLElement;
const recording = document.getElementById('recording')?.textContent;
const app = new App(root, page, recording ? unstore(recording) : undefined);

// For tests, and for whoever looks in from the console.
Object.assign(window, { mbcosim: app });
