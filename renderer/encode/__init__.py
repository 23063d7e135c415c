"""What comes out: images, movies and contact sheets as files."""
