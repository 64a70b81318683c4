// SPDX-License-Identifier: Apache-2.0
// Bundles the page into one HTML file: script and style inline, and a content security policy that lets
// that one script run (by its hash) and nothing else: no other script, no request to anywhere.
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { defineConfig, type Plugin } from 'vite';

function singleFile(): Plugin {
  return {
    name: 'single-file',
    enforce: 'post',
    generateBundle(_, bundle) {
      const page = bundle['index.html'];
      if (page?.type !== 'asset') throw new Error('index.html is missing from the bundle');
      let script = '';
      let style = '';
      for (const [name, file] of Object.entries(bundle)) {
        if (file.type === 'chunk') script += file.code;
        else if (name.endsWith('.css')) style += String(file.source);
        else if (file !== page) throw new Error(`${name} cannot be put into one file`);
        if (file !== page) delete bundle[name];
      }
      // "</script" inside a string literal would end the element; "<!--" would change how it is parsed.
      const licence = readFileSync(new URL('node_modules/three/LICENSE', import.meta.url), 'utf8').trim();
      script = `/*! The report page of vggt-cd (Apache-2.0). It contains three.js:\n${licence} */\n${script}`;
      script = script.replace(/<\/(script)/gi, '<\\/$1').replace(/<!--/g, '<\\!--').trim();
      const hash = createHash('sha256').update(script).digest('base64');
      const policy =
        `default-src 'none'; script-src 'sha256-${hash}'; style-src 'unsafe-inline'; ` +
        `img-src data: blob:; base-uri 'none'; form-action 'none'`;
      page.source = String(page.source)
        .replace(/\s*<script type="module"[^>]*><\/script>/, '')
        .replace(/\s*<link rel="(stylesheet|modulepreload)"[^>]*>/g, '')
        .replace('%POLICY%', () => policy)
        .replace('</head>', () => `<style>${style.trim()}</style>\n</head>`)
        .replace('</body>', () => `<script>${script}</script>\n</body>`);
    },
  };
}

export default defineConfig({
  plugins: [singleFile()],
  build: {
    target: 'es2021',
    outDir: process.env.VGGTCD_VIEWER_OUT ?? 'dist',
    emptyOutDir: false,
    modulePreload: false,
    cssCodeSplit: false,
    chunkSizeWarningLimit: 2000,
    reportCompressedSize: false,
    rollupOptions: { output: { format: 'iife' } },
  },
});
