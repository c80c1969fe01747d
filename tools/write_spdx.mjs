// Writes the bill of materials of the packages as SPDX 2.3 (JSON): doppel, the libraries of the page that are part of it
// (web/package-lock.json), and the Debian packages that it is built with (packages.txt), with the installed versions.
//
//   node tools/write_spdx.mjs OUTPUT VERSION
//
// SOURCE_DATE_EPOCH is the time in it, without which it is that of the newest commit, so that two builds write the same file.
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { createHash } from 'node:crypto';

const root = fileURLToPath(new URL('..', import.meta.url));
const [output, version] = process.argv.slice(2);
if (!output || !version) {
  console.error('error: node tools/write_spdx.mjs OUTPUT VERSION');
  process.exit(2);
}

function run(command, ...words) {
  try {
    return execFileSync(command, words, { cwd: root, encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] });
  } catch {
    return '';
  }
}

const identifier = (kind, name) => `SPDXRef-${kind}-${name.replace(/[^A-Za-z0-9.]+/g, '-')}`;

// The libraries that the page contains: what it depends on, and what those depend on.
function pageLibraries() {
  const locked = JSON.parse(readFileSync(`${root}/web/package-lock.json`, 'utf8')).packages;
  return Object.entries(locked)
    .filter(([path, entry]) => path !== '' && !entry.dev && !entry.optional)
    .map(([path, entry]) => {
      const name = path.replace(/^.*node_modules\//, '');
      const hash = /^sha512-(.+)$/.exec(entry.integrity ?? '');
      return {
        SPDXID: identifier('npm', name),
        name,
        versionInfo: entry.version,
        downloadLocation: entry.resolved ?? `https://registry.npmjs.org/${name}`,
        filesAnalyzed: false,
        licenseConcluded: 'NOASSERTION',
        licenseDeclared: entry.license ?? 'NOASSERTION',
        copyrightText: 'NOASSERTION',
        ...(hash && { checksums: [{ algorithm: 'SHA512', checksumValue: Buffer.from(hash[1], 'base64').toString('hex') }] }),
        externalRefs: [
          { referenceCategory: 'PACKAGE-MANAGER', referenceType: 'purl', referenceLocator: `pkg:npm/${encodeURIComponent(name)}@${entry.version}` },
        ],
      };
    });
}

// The packages of kind "run" that are installed.
function debianPackages() {
  const names = readFileSync(`${root}/packages.txt`, 'utf8')
    .split('\n')
    .map((line) => line.split(/\s+/))
    .filter(([name, kind]) => name && !name.startsWith('#') && /^run(@|$)/.test(kind ?? ''))
    .map(([name]) => name);
  return names.flatMap((name) => {
    const installed = run('dpkg-query', '-W', '-f=${db:Status-Abbrev}${Version}', name);
    if (!installed.startsWith('ii')) return [];
    const found = installed.slice(2).trim();
    return [
      {
        SPDXID: identifier('deb', name),
        name,
        versionInfo: found,
        downloadLocation: 'NOASSERTION',
        filesAnalyzed: false,
        licenseConcluded: 'NOASSERTION',
        licenseDeclared: 'NOASSERTION',
        copyrightText: 'NOASSERTION',
        externalRefs: [
          { referenceCategory: 'PACKAGE-MANAGER', referenceType: 'purl', referenceLocator: `pkg:deb/debian/${name}@${encodeURIComponent(found)}` },
        ],
      },
    ];
  });
}

const seconds = Number(process.env.SOURCE_DATE_EPOCH ?? (run('git', 'log', '-1', '--format=%ct').trim() || 0));
const libraries = pageLibraries();
const packages = debianPackages();
const self = 'SPDXRef-doppel';
const relation = (from, kind, to) => ({ spdxElementId: from, relationshipType: kind, relatedSpdxElement: to });
const contents = JSON.stringify([libraries, packages]);
const document = {
  spdxVersion: 'SPDX-2.3',
  dataLicense: 'CC0-1.0',
  SPDXID: 'SPDXRef-DOCUMENT',
  name: `doppel-${version}`,
  // Unique for each content, as SPDX requires it, and the same for the same content.
  documentNamespace: `https://spdx.org/spdxdocs/doppel-${version}-${createHash('sha256').update(contents).digest('hex').slice(0, 32)}`,
  creationInfo: { created: new Date(seconds * 1000).toISOString().replace('.000', ''), creators: ['Tool: doppel tools/write_spdx.mjs'] },
  packages: [
    {
      SPDXID: self,
      name: 'doppel',
      versionInfo: version,
      downloadLocation: 'NOASSERTION',
      filesAnalyzed: false,
      licenseConcluded: 'Apache-2.0',
      licenseDeclared: 'Apache-2.0',
      copyrightText: 'NOASSERTION',
      primaryPackagePurpose: 'APPLICATION',
    },
    ...libraries,
    ...packages,
  ],
  relationships: [
    relation('SPDXRef-DOCUMENT', 'DESCRIBES', self),
    ...libraries.map((library) => relation(self, 'CONTAINS', library.SPDXID)),
    ...packages.map((needed) => relation(needed.SPDXID, 'BUILD_DEPENDENCY_OF', self)),
  ],
};
writeFileSync(output, `${JSON.stringify(document, null, 1)}\n`);
