"""The tables of a study's database. Times are seconds since 1970 (UTC); browsers tell milliseconds of their own."""

from __future__ import annotations

from typing import Final

__all__ = ["SCHEMA", "TABLES"]

SCHEMA: Final = 1

TABLES: Final = """
-- What this database is: schema, mode (live or debug), study, created, recruitment (open, paused or closed).
CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;

-- Texts that participants agreed to, word by word.
CREATE TABLE texts (
  sha256 TEXT PRIMARY KEY,
  name TEXT NOT NULL,
  text TEXT NOT NULL,
  stored REAL NOT NULL
) WITHOUT ROWID;

-- One row a participant: P001, P002, ... (debug: D001, ...). `state` is active, or the ending.
CREATE TABLE participants (
  participant TEXT PRIMARY KEY,
  design TEXT NOT NULL,               -- hash of the study's design
  token_sha256 TEXT NOT NULL UNIQUE,  -- of the token in their link; the token itself is nowhere
  order_number INTEGER NOT NULL,      -- row of the order policy's square
  conditions TEXT NOT NULL,           -- JSON list: the conditions in their order
  seed INTEGER NOT NULL,
  joined REAL NOT NULL,
  seen REAL NOT NULL,                 -- last sign of life
  screen INTEGER NOT NULL,            -- index in the timeline
  state TEXT NOT NULL,
  ended REAL,
  language TEXT NOT NULL
) WITHOUT ROWID;

-- The only table that knows who they are. No export touches it.
CREATE TABLE workers (
  participant TEXT PRIMARY KEY,
  source TEXT NOT NULL,
  worker TEXT NOT NULL,
  study TEXT NOT NULL,                -- the platform's study or HIT
  session TEXT NOT NULL,              -- the platform's session or assignment
  joined REAL NOT NULL
) WITHOUT ROWID;
CREATE INDEX workers_of ON workers (source, worker);

-- One row for each screen that was begun; a screen begun again (practice, restart) has another.
CREATE TABLE visits (
  visit INTEGER PRIMARY KEY,
  participant TEXT NOT NULL,
  design TEXT NOT NULL,
  screen INTEGER NOT NULL,
  name TEXT NOT NULL,
  kind TEXT NOT NULL,
  sitting INTEGER NOT NULL,
  condition TEXT NOT NULL,
  round INTEGER NOT NULL,
  attempt INTEGER NOT NULL,           -- from 1
  layout_id TEXT NOT NULL,            -- of a game
  seed INTEGER NOT NULL,
  begun REAL NOT NULL,
  finished REAL,
  outcome TEXT                        -- JSON: of a game `outcome()`; of other screens what the page measured
);
CREATE INDEX visits_of ON visits (participant, visit);

-- One row a step of a game.
CREATE TABLE steps (
  visit INTEGER NOT NULL,
  step INTEGER NOT NULL,              -- from 0
  participant TEXT NOT NULL,
  design TEXT NOT NULL,
  action TEXT NOT NULL,               -- JSON: 0..5, or [vx, vy] in units of max_speed
  before TEXT NOT NULL,               -- digest of the state that the action was taken in
  key_down REAL,                      -- page: when the key went down (kitchens), or the time of the pointer (tables)
  frame_shown REAL,                   -- page: when that state was first on the screen
  received REAL NOT NULL,
  PRIMARY KEY (visit, step)
) WITHOUT ROWID;

-- One row a sample of the pointer, at the rate of the screen (tables).
CREATE TABLE pointer (
  visit INTEGER NOT NULL,
  sample INTEGER NOT NULL,            -- from 0
  participant TEXT NOT NULL,
  design TEXT NOT NULL,
  at REAL NOT NULL,                   -- page: milliseconds since the round began
  x REAL NOT NULL,                    -- metres on the table, before any clamping
  y REAL NOT NULL,
  PRIMARY KEY (visit, sample)
) WITHOUT ROWID;

-- One row an answer. The consent is one: item `consent`, value the SHA-256 of the text.
CREATE TABLE answers (
  visit INTEGER NOT NULL,
  item TEXT NOT NULL,
  participant TEXT NOT NULL,
  design TEXT NOT NULL,
  questionnaire TEXT NOT NULL,
  value TEXT NOT NULL,                -- JSON
  answered REAL NOT NULL,
  PRIMARY KEY (visit, item)
) WITHOUT ROWID;

-- Connects, disconnects, focus, blur, visibility, warnings, refusals, errors, endings.
CREATE TABLE events (
  event INTEGER PRIMARY KEY,
  participant TEXT NOT NULL,          -- empty: of the server
  design TEXT NOT NULL,
  at REAL NOT NULL,
  kind TEXT NOT NULL,
  detail TEXT NOT NULL                -- JSON
);
CREATE INDEX events_of ON events (participant, event);
"""
