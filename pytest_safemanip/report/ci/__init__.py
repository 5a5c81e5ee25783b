"""A run in the formats of CI servers: Markdown, annotations, SARIF, attachments of JUnit."""
